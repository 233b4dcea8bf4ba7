// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>

#include "base/file.hpp"
#include "compensation/model_text.hpp"

namespace prism::commands {
namespace {

std::atomic<bool> interrupted{false};

void interrupt(int) {
  interrupted = true;
  std::signal(SIGINT, SIG_DFL);
}

std::atomic<bool> bar_drawn{false};

/// Draws one line that fits the terminal: a longer one would add a line with each drawing.
void draw(double share, std::string text) {
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  const int columns = known ? size.ws_col - 1 : 79;
  const int width = std::min(30, columns - static_cast<int>(text.size()) - 3);  // of the bar without its brackets
  if (width >= 5) {
    const int filled = static_cast<int>(width * std::clamp(share, 0.0, 1.0));
    text = fmt::format("[{:#<{}}{:{}}] {}", "", filled, "", width - filled, text);
  }
  fmt::print(stderr, "\r{}\033[K", text.substr(0, static_cast<std::size_t>(columns)));
  bar_drawn = true;
}

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
  namespace fs = std::filesystem;
  std::error_code error;
  std::vector<std::string> files;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().extension() == ".json") files.push_back(entry->path().string());
  }
  if (error) return make_error(folder, fmt::format("{}; expected a folder of models", error.message()));
  std::sort(files.begin(), files.end());
  std::vector<compensation::ModelPtr> models;
  std::size_t own = 0;
  for (const std::string& file : files) {
    auto model = load_model(file);
    if (!model) return tl::unexpected<Error>(model.error());
    const bool is_own = !own_serial.empty() && (*model)->info().gyro_serial == own_serial;
    own += is_own;
    if (!is_own) models.push_back(std::move(*model));
  }
  if (models.size() < 2) {
    return make_error(folder, fmt::format("found {} models of other gyros ({} of this one), expected at least 2",
                                          models.size(), own));
  }
  return models;
}

const std::atomic<bool>* stop_on_interrupt() {
  std::signal(SIGINT, interrupt);
  return &interrupted;
}

training::TuningProgress progress_bar(bool quiet) {
  if (quiet || isatty(STDERR_FILENO) == 0) return {};
  return [](int done, int expected, const training::TuningPoint& best) {
    draw(static_cast<double>(done) / std::max(1, expected),
         fmt::format("{} of about {}, best cost {:.6g} at c {:.4g}, sigma2 {:.4g}", done, expected, best.cost, best.c,
                     best.sigma2));
  };
}

void end_progress() {
  if (bar_drawn.exchange(false)) fmt::print(stderr, "\n");
}

}  // namespace prism::commands
