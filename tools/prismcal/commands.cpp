// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "base/file.hpp"
#include "compensation/model_text.hpp"
#include "tools/prismcal/log_folder.hpp"

namespace prism::commands {
namespace {

std::atomic<bool> interrupted{false};

void interrupt(int) {
  interrupted = true;
  std::signal(SIGINT, SIG_DFL);
}

std::atomic<bool> line_drawn{false};

}  // namespace

int failed(const Error& error) {
  end_progress();
  fmt::print(stderr, "prismcal: {}\n", error.text());
  return 1;
}

int exit_code(const Result<int>& done) { return done ? *done : failed(done.error()); }

Result<compensation::ModelPtr> load_model(const std::string& path) {
  return read_text_file(path, kMaxModelBytes).and_then([&](const std::string& text) {
    return compensation::parse_model(text, path);
  });
}

Result<std::vector<compensation::ModelPtr>> read_population_models(const std::string& folder,
                                                                   const std::string& own_serial) {
  std::vector<compensation::ModelPtr> models;
  std::size_t own = 0;
  for (const std::string& file : recordings::files_of(folder, ".json")) {
    auto model = load_model(file);
    if (!model) return tl::unexpected<Error>(model.error());
    const bool is_own = !own_serial.empty() && (*model)->info().gyro_serial == own_serial;
    own += is_own;
    if (!is_own) models.push_back(std::move(*model));
  }
  if (models.size() < 2) {
    return make_error(folder,
                      fmt::format("found {} models of other gyros ({} of this one), expected a folder with 2 or more",
                                  models.size(), own));
  }
  return models;
}

const std::atomic<bool>* stop_on_interrupt() {
  std::signal(SIGINT, interrupt);
  return &interrupted;
}

training::TuningProgress progress_line(bool quiet) {
  if (quiet || isatty(STDERR_FILENO) == 0) return {};
  return [](int done, int expected, const training::TuningPoint& best) {
    constexpr std::size_t kColumns = 79;  // a longer line would add a line to most terminals with each drawing
    const std::string text = fmt::format("{} of about {}, best cost {:.6g} at c {:.4g}, sigma2 {:.4g}", done, expected,
                                         best.cost, best.c, best.sigma2);
    fmt::print(stderr, "\r{}\033[K", text.substr(0, kColumns));
    line_drawn = true;
  };
}

void end_progress() {
  if (line_drawn.exchange(false)) fmt::print(stderr, "\n");
}

}  // namespace prism::commands
