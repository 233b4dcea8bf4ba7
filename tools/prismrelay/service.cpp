// SPDX-License-Identifier: MIT
#include "tools/prismrelay/service.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <signal.h>

#include <chrono>
#include <memory>
#include <thread>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_member.hpp"
#include "base/notify.hpp"
#include "tools/metrics/exposition.hpp"
#include "tools/prismrelay/database_loop.hpp"
#include "tools/prismrelay/live_loop.hpp"
#include "tools/prismrelay/options.hpp"
#include "tools/prismrelay/relay_metrics.hpp"
#include "tools/prismrelay/report.hpp"
#include "tools/prismrelay/row_database.hpp"
#include "tools/prismrelay/schema.hpp"

namespace prism::prismrelay {
namespace {

using std::chrono_literals::operator""s;

// Longer than any single wait of a loop: an attempt that failed and waits is progress.
constexpr std::chrono::seconds kTimeout = RowDatabase::kTimeout * 2;
constexpr auto kRound = 1s;
constexpr int kStatusEvery = 2;  // rounds

int fail(const Error& error, int code = kExitFailed) {
  fmt::print(stderr, "prismrelay: {}\n", error.text());
  return code;
}

/// What a thread of its own would do for the loops, once a second: status, metrics, systemd.
class Reporter {
 public:
  Reporter(const Settings& settings, const RelayState& state) : settings_(settings), state_(state) {}

  void round() {
    const RelayState::View view = state_.view();
    if (rounds_++ % kStatusEvery == 0) write_status(view);
    if (settings_.metrics && host_time_s() - measured_s_ >= settings_.metrics->every_s) write_metrics(view);
    if (std::string now = summary(view); now != shown_) notify_status(shown_ = std::move(now));
    if (watchdog_ && state_.all_progress(2, kTimeout)) notify_watchdog();
  }

 private:
  void write_status(const RelayState::View& view) {
    const auto written = write_text_file(settings_.status_file, json_text(status_json(settings_, view), 2) + "\n");
    const std::string why = written ? "" : written.error().text();
    if (why != fault_ && !why.empty()) say(Level::kWarning, "the status cannot be written: " + why);
    fault_ = why;
  }

  void write_metrics(const RelayState::View& view) {
    measured_s_ = host_time_s();
    const auto written = metrics::write_exposition(settings_.metrics->file, metrics_text(view));
    const std::string why = written ? "" : written.error().text();
    if (why != metrics_fault_ && !why.empty()) say(Level::kWarning, "the metrics cannot be written: " + why);
    metrics_fault_ = why;
  }

  const Settings& settings_;
  const RelayState& state_;
  const bool watchdog_ = watchdog_half_us() > 0;
  unsigned rounds_ = 0;
  double measured_s_ = 0;
  std::string shown_, fault_, metrics_fault_;
};

int show_status(const Settings& settings, bool as_json) {
  const auto text = read_text_file(settings.status_file);
  if (!text) return fail({settings.status_file, "no relay wrote its status here; start prismrelay"});
  const auto status = nlohmann::ordered_json::parse(*text, nullptr, false);
  if (!status.is_object()) return fail({settings.status_file, "is no status of prismrelay"});
  if (as_json) {
    fmt::print("{}\n", printable_json(json_text(status, 2)));
  } else {
    fmt::print("{}", printable_lines(status_view(status, host_time_s())));
  }
  return host_time_s() - number_member(status, "time_s") > 10 ? kExitFailed : kExitDone;
}

}  // namespace

int run_service(const Settings& settings) {
  // A thousand followers hold a page each now and then: what they gave back goes back to the system.
  mallopt(M_MMAP_THRESHOLD, 64 << 10);
  mallopt(M_TRIM_THRESHOLD, 1 << 20);
  sigset_t ends;
  sigemptyset(&ends);
  for (const int signal : {SIGTERM, SIGINT}) sigaddset(&ends, signal);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);  // before the threads, which inherit it
  ::signal(SIGPIPE, SIG_IGN);

  RelayState state;
  std::unique_ptr<DatabaseLoop> ledger;
  std::unique_ptr<LiveLoop> live;
  std::vector<std::thread> threads;
  for (const std::size_t loop : {DatabaseLoop::kLoop, LiveLoop::kLoop}) state.progress(loop);
  if (settings.postgresql) ledger = std::make_unique<DatabaseLoop>(settings, state);
  if (settings.mqtt || settings.metrics) live = std::make_unique<LiveLoop>(settings, state);
  if (ledger) threads.emplace_back([&] { ledger->run(); });
  if (live) threads.emplace_back([&] { live->run(); });
  Reporter reporter(settings, state);
  notify_ready("looking for gyros");
  say(Level::kInfo, fmt::format("carrying the gyros of {} as {}", fmt::join(settings.instances, ", "), settings.site));
  const timespec round{std::chrono::seconds(kRound).count(), 0};
  while (sigtimedwait(&ends, nullptr, &round) < 0) {
    if (!ledger) state.progress(DatabaseLoop::kLoop);
    if (!live) state.progress(LiveLoop::kLoop);
    reporter.round();
  }
  notify_stopping();
  if (ledger) ledger->stop();
  if (live) live->stop();
  for (std::thread& thread : threads) thread.join();
  say(Level::kInfo, "ended");
  return kExitDone;
}

int run(int argc, char** argv) {
  Options options;
  if (const auto code = parse_options(argc, argv, options)) return *code;
  if (options.schema) {
    fmt::print("{}", schema_sql());
    return kExitDone;
  }
  const auto settings = load_settings(options.config);
  if (!settings) return fail(settings.error(), kExitConfig);
  if (options.check) {
    fmt::print("{}: good: site {}, to{}{}{}\n", settings->path, settings->site,
               settings->postgresql ? " postgresql" : "", settings->mqtt ? " mqtt" : "",
               settings->metrics ? " metrics" : "");
    return kExitDone;
  }
  if (options.status) return show_status(*settings, options.json);
  if (options.init) {
    if (!settings->postgresql)
      return fail({settings->path, "has no postgresql, expected a database to make tables in"}, kExitConfig);
    const auto done = init_schema(*settings->postgresql);
    if (!done) return fail(done.error());
    fmt::print("{}\n", *done);
    return kExitDone;
  }
  return run_service(*settings);
}

}  // namespace prism::prismrelay
