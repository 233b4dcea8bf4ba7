// SPDX-License-Identifier: MIT
#include "tools/prismrelay/service.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <signal.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_member.hpp"
#include "base/notify.hpp"
#include "base/time_scale.hpp"
#include "tools/metrics/exposition.hpp"
#include "tools/prismrelay/database_loop.hpp"
#include "tools/prismrelay/live_loop.hpp"
#include "tools/prismrelay/options.hpp"
#include "tools/prismrelay/relay_metrics.hpp"
#include "tools/prismrelay/report.hpp"
#include "tools/prismrelay/row_database.hpp"
#include "tools/prismrelay/schema.hpp"
#include "tools/prismrelay/schema_init.hpp"

namespace prism::prismrelay {
namespace {

using std::chrono_literals::operator""s;

// Twice the longest operation of a loop. Waiting for a retry is progress.
constexpr std::chrono::seconds kTimeout = RowDatabase::kTimeout * 2;
constexpr auto kRound = 1s;
constexpr int kStatusEvery = 2;  // rounds

int fail(const Error& error, int code = kExitFailed) {
  fmt::print(stderr, "prismrelay: {}\n", error.text());
  return code;
}

/// Writes the status and metrics and notifies systemd. round() is called once a second by the main thread.
class Reporter {
 public:
  Reporter(const Settings& settings, const RelayState& state) : settings_(settings), state_(state) {}

  void round() {
    const RelayState::View view = state_.view();
    if (rounds_++ % kStatusEvery == 0) write_status(view);
    if (settings_.metrics && host_time_s() - measured_s_ >= settings_.metrics->every_s) write_metrics(view);
    if (std::string status = summary(view); status != reported_) notify_status(reported_ = std::move(status));
    if (watchdog_ && state_.all_progress(2, kTimeout)) notify_watchdog();
  }

 private:
  void write_status(const RelayState::View& view) {
    const auto written = write_text_file(settings_.status_file, json_text(status_json(settings_, view), 2) + "\n");
    report(status_problem_, "status", written);
  }

  void write_metrics(const RelayState::View& view) {
    measured_s_ = host_time_s();
    const auto written = metrics::write_exposition(settings_.metrics->file, metrics_text(view));
    report(metrics_problem_, "metrics", written);
  }

  static void report(std::string& told, const char* what, const Result<void>& written) {
    const std::string problem = written ? "" : written.error().text();
    if (std::exchange(told, problem) == problem || problem.empty()) return;
    log_line(Level::kWarning, fmt::format("cannot write the {}: {}", what, problem));
  }

  const Settings& settings_;
  const RelayState& state_;
  const bool watchdog_ = watchdog_half_us() > 0;
  unsigned rounds_ = 0;
  double measured_s_ = 0;
  std::string reported_;
  std::string status_problem_, metrics_problem_;  ///< as told
};

int show_status(const Settings& settings, bool as_json) {
  const auto text = read_text_file(settings.status_file);
  if (!text) return fail({settings.status_file, "cannot read the status; is prismrelay running?"});
  const auto status = nlohmann::ordered_json::parse(*text, nullptr, false);
  if (!status.is_object()) return fail({settings.status_file, "not a status file of prismrelay"});
  if (as_json) {
    fmt::print("{}\n", printable_json(json_text(status, 2)));
  } else {
    fmt::print("{}", printable_lines(status_view(status, host_time_s())));
  }
  return host_time_s() - number_member(status, "time_s") > 10 ? kExitFailed : kExitDone;
}

}  // namespace

int run_service(const Settings& settings) {
  // Returns freed page buffers to the system: with a thousand logs the heap would stay large.
  mallopt(M_MMAP_THRESHOLD, 64 << 10);
  mallopt(M_TRIM_THRESHOLD, 1 << 20);
  sigset_t stop_signals;
  sigemptyset(&stop_signals);
  for (const int signal : {SIGTERM, SIGINT}) sigaddset(&stop_signals, signal);
  pthread_sigmask(SIG_BLOCK, &stop_signals, nullptr);  // before the threads, which inherit it
  ::signal(SIGPIPE, SIG_IGN);

  RelayState state;
  std::unique_ptr<DatabaseLoop> database;
  std::unique_ptr<LiveLoop> live;
  std::vector<std::thread> threads;
  for (const std::size_t loop : {DatabaseLoop::kLoop, LiveLoop::kLoop}) state.progress(loop);
  if (settings.postgresql) database = std::make_unique<DatabaseLoop>(settings, state);
  if (settings.mqtt || settings.metrics) live = std::make_unique<LiveLoop>(settings, state);
  if (database) threads.emplace_back([&] { database->run(); });
  if (live) threads.emplace_back([&] { live->run(); });
  Reporter reporter(settings, state);
  notify_ready("looking for gyros");
  log_line(Level::kInfo,
           fmt::format("sending the rows of {} as site {}", fmt::join(settings.instances, ", "), settings.site));
  const auto round_ns = std::chrono::nanoseconds(scaled(kRound)).count();
  const timespec round{round_ns / 1'000'000'000, round_ns % 1'000'000'000};
  while (sigtimedwait(&stop_signals, nullptr, &round) < 0) {
    if (!database) state.progress(DatabaseLoop::kLoop);
    if (!live) state.progress(LiveLoop::kLoop);
    reporter.round();
  }
  notify_stopping();
  if (database) database->stop();
  if (live) live->stop();
  for (std::thread& thread : threads) thread.join();
  log_line(Level::kInfo, "stopped");
  return kExitDone;
}

int run(int argc, char** argv) {
  Options options;
  if (const auto code = parse_options(argc, argv, options)) return *code;
  if (const auto scale = check_time_scale(); !scale) return fail(scale.error(), kExitConfig);
  if (options.schema) {
    fmt::print("{}", schema_sql());
    return kExitDone;
  }
  const auto settings = load_settings(options.config);
  if (!settings) return fail(settings.error(), kExitConfig);
  for (const std::string& warning : settings->warnings) fmt::print(stderr, "prismrelay: warning: {}\n", warning);
  if (options.check) {
    fmt::print("{}: good: site {}, to{}{}{}\n", settings->path, settings->site,
               settings->postgresql ? " postgresql" : "", settings->mqtt ? " mqtt" : "",
               settings->metrics ? " metrics" : "");
    return kExitDone;
  }
  if (options.status) return show_status(*settings, options.json);
  if (options.init) {
    if (!settings->postgresql)
      return fail({settings->path, "postgresql is missing; --init needs a database"}, kExitConfig);
    const auto done = init_schema(*settings->postgresql);
    if (!done) return fail(done.error());
    fmt::print("{}\n", *done);
    return kExitDone;
  }
  return run_service(*settings);
}

}  // namespace prism::prismrelay
