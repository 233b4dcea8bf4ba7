// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
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

/// "2 h 05 min", "12 s".
std::string duration_text(double s) {
  const auto rounded = static_cast<long>(s + 0.5);
  if (rounded < 100) return fmt::format("{} s", rounded);
  if (rounded < 5400) return fmt::format("{} min {:02} s", rounded / 60, rounded % 60);
  return fmt::format("{} h {:02} min", rounded / 3600, rounded / 60 % 60);
}

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

tables::ReadProgress read_progress() {
  using Clock = std::chrono::steady_clock;
  constexpr double kPatience_s = 2, kBetween_s = 0.2;
  if (isatty(STDERR_FILENO) == 0) return {};
  // A command may read several recordings, one after the other; a new reading begins with fewer bytes.
  return [began = Clock::time_point(), drawn = Clock::time_point(),
          last_bytes = std::uint64_t{UINT64_MAX}](const tables::ReadState& state) mutable {
    const auto now = Clock::now();
    const auto since = [now](Clock::time_point then) { return std::chrono::duration<double>(now - then).count(); };
    if (state.bytes < last_bytes) began = drawn = now;
    last_bytes = state.bytes;
    const bool done = state.bytes >= state.of_bytes;
    const double seconds = since(began), share = static_cast<double>(state.bytes) / static_cast<double>(state.of_bytes);
    if (done && drawn != began) end_progress();
    if (done || seconds < kPatience_s || since(drawn) < kBetween_s) return;
    drawn = now;
    draw(share,
         fmt::format("{:.0f} %, {} left, {:.2f} million rows/s", 100 * share,
                     duration_text(seconds * (1 - share) / share), 1e-6 * static_cast<double>(state.rows) / seconds));
  };
}

void end_progress() {
  if (bar_drawn.exchange(false)) fmt::print(stderr, "\n");
}

}  // namespace prism::commands
