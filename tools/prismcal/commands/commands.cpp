// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/commands.hpp"

#include <fmt/format.h>

#include <csignal>
#include <cstdio>

#include "base/file.hpp"
#include "compensation/model_text.hpp"
#include "tools/prismcal/commands/progress_bars.hpp"

namespace prism::commands {
namespace {

std::atomic<bool> interrupted{false};

void interrupt(int) {
  interrupted = true;
  std::signal(SIGINT, SIG_DFL);
}

}  // namespace

int failed(const Error& error) {
  end_progress();
  fmt::print(stderr, "prismcal: {}\n", error.text());
  return 1;
}

Result<compensation::ModelPtr> load_model(const std::string& path) {
  return read_text_file(path, kMaxModelBytes).and_then([&](const std::string& text) {
    return compensation::parse_model(text, path);
  });
}

const std::atomic<bool>* stop_on_interrupt() {
  std::signal(SIGINT, interrupt);
  return &interrupted;
}

}  // namespace prism::commands
