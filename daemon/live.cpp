// SPDX-License-Identifier: MIT
// prismd beside the gyro.
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <utility>

#include "base/notify.hpp"
#include "daemon/answers.hpp"
#include "daemon/awaiting.hpp"
#include "daemon/capture_log.hpp"
#include "daemon/live_line.hpp"
#include "daemon/logging.hpp"
#include "daemon/reloader.hpp"
#include "daemon/server.hpp"
#include "daemon/service.hpp"

namespace prism::daemon {
namespace {

namespace asio = boost::asio;
constexpr std::size_t kDiskQueueBytes = 4 << 20;
constexpr std::chrono::seconds kDiskPatience{3};
constexpr std::chrono::milliseconds kLastPatience{3500};

class Live {
 public:
  Live(const Options& options, const pipeline::Setup& setup)
      : disk_(kDiskQueueBytes, teller()),
        instance_(setup, make_logs(setup), make_capture(setup), log_event),
        gyro_(instance_),
        line_(io_, instance_, gyro_, clock_, setup.sensor_lines.empty()),
        reloader_(Reloader::make(
            io_, loader_,
            [path = options.config, overrides = overrides_of(options)] {
              return pipeline::load_setup(path, overrides);
            },
            instance_, [this] { reopen(); })),
        rpc_(instance_, [this](Reloader::Done done) { reloader_->reload(std::move(done)); }),
        signals_(io_, SIGINT, SIGTERM, SIGHUP),
        tick_(io_) {
    instance_.acquisition.capture_sensors(make_sensor_captures(setup));
    for (std::size_t i = 0; i < setup.sensor_lines.size(); ++i)
      sensor_lines_.push_back(std::make_unique<SensorLine>(io_, instance_, i, clock_));
  }

  int run() {
    const config::Config& config = setup().config;
    const int inherited = inherited_socket();
    if (!config.socket.path.empty() || inherited >= 0) {
      auto server = Server::open(io_, config.socket, inherited, instance_, rpc_);
      if (!server) {
        spdlog::error(server.error().text());
        return kExitFailed;
      }
      server_ = std::move(*server);
      asio::co_spawn(io_, server_->serve(), asio::detached);
    }
    for (const std::string& note : setup().notes) instance_.tell(Severity::kInfo, "note", note);
    tell_missing_models();
    for (const auto& sensors : sensor_lines_) sensors->line.start();
    line_.start();
    asio::co_spawn(io_, heed_signals(), asio::detached);
    asio::co_spawn(io_, tick(), asio::detached);
    notify_ready(summary(instance_));
    io_.run();
    notify_stopping();
    instance_.finish();
    return end_disk();
  }

 private:
  struct SensorLine {
    SensorLine(asio::io_context& io, Instance& instance, std::size_t index, ArrivalClock& clock)
        : port(instance, index), line(io, instance, port, clock, false) {}
    SensorPort port;
    LiveLine line;
  };

  void reopen() {
    line_.reopen();
    for (const auto& sensors : sensor_lines_) sensors->line.reopen();
  }

  // Where the gyro's line is not open its next session begins with it.
  void follow_clock() {
    const std::int64_t step = line_.is_open() || !sensor_lines_.empty() ? clock_.check() : 0;
    if (step == 0) return;
    instance_.tell(
        Severity::kWarning, "host_clock",
        fmt::format("the host clock was set by {:+.3f} s; the window begins anew", static_cast<double>(step) * 1e-9));
    const std::int64_t now_ns = clock_.now_ns();
    instance_.clock_set(now_ns - step, now_ns);
  }

  void tell_missing_models() {
    const Acquisition& acquisition = instance_.acquisition;
    for (std::size_t i = 0; i < acquisition.axes(); ++i) {
      if (setup().axes[i].model) continue;
      instance_.tell(
          Severity::kWarning, "no_model",
          acquisition.axis_prefix(i) + "no model is configured: rates are published uncorrected, marked no_model");
    }
  }

  // A disk that hangs does not hold up the end: what it did not take is told, and the process leaves it behind.
  int end_disk() {
    const LogCounters* const log = instance_.acquisition.log();
    instance_.acquisition.close();
    const bool done = disk_.drain(kLastPatience);
    instance_.publisher.release();
    if (done && loader_.drain(kLastPatience)) return kExitDone;
    if (done) {
      spdlog::error("a file of a reload cannot be read to its end; it is left");
      finish_logging();
      ::_exit(kExitDone);
    }
    spdlog::error(fmt::format("the disk does not answer: {} rows were not written, and {} more are not safe",
                              log ? log->pending.load() : 0, log ? log->unsynced.load() : 0));
    finish_logging();
    ::_exit(kExitFailed);
  }

  // A disk that hangs says nothing itself.
  void watch_disk() {
    using std::chrono::seconds;
    const auto busy = std::chrono::duration_cast<seconds>(disk_.busy_for());
    if (busy >= kDiskPatience && !disk_hangs_) {
      disk_hangs_ = true;
      const LogCounters* const log = instance_.acquisition.log();
      instance_.tell(
          Severity::kWarning, "disk",
          fmt::format("the disk has not answered for {} s; {} rows wait", busy.count(), log ? log->pending.load() : 0));
    } else if (busy < kDiskPatience && std::exchange(disk_hangs_, false)) {
      instance_.tell(Severity::kInfo, "disk", "the disk answers again");
    }
  }

  const pipeline::Setup& setup() const { return instance_.acquisition.setup(); }

  // Faults found on the disk thread are told on the live one, where the instance lives as long as the context runs.
  std::function<void(const std::string&)> teller() {
    return [this](const std::string& what) {
      asio::post(io_, [this, what] { instance_.tell(Severity::kWarning, "disk", what); });
    };
  }
  std::vector<std::unique_ptr<RowWriter>> make_logs(const pipeline::Setup& setup) {
    const auto counters = std::make_shared<LogCounters>();
    const auto written = [this] { asio::post(io_, [this] { instance_.rows_written(); }); };
    const auto synced = [this] { asio::post(io_, [this] { instance_.row_requests.synced(); }); };
    return daemon::make_logs(setup, [&](config::SegmentSettings settings, std::string name, std::string metadata) {
      return std::make_unique<ThreadedRowWriter>(std::move(settings), std::move(name), std::move(metadata), disk_,
                                                 teller(), written, counters, synced);
    });
  }
  std::unique_ptr<CaptureLog> make_capture(const pipeline::Setup& setup) {
    if (!setup.config.capture) return nullptr;
    return std::make_unique<CaptureLog>(*setup.config.capture, setup.config.name, disk_, teller());
  }

  // Each in a folder of its own: a folder of captures is of one line.
  std::vector<std::unique_ptr<CaptureLog>> make_sensor_captures(const pipeline::Setup& setup) {
    std::vector<std::unique_ptr<CaptureLog>> captures;
    if (!setup.config.capture) return captures;
    for (const pipeline::Setup::SensorLine& line : setup.sensor_lines) {
      config::SegmentSettings settings = *setup.config.capture;
      settings.directory += "/" + line.name;
      captures.push_back(
          std::make_unique<CaptureLog>(std::move(settings), setup.config.name + "-" + line.name, disk_, teller()));
    }
    return captures;
  }

  asio::awaitable<void> heed_signals() {
    for (;;) {
      auto [error, signal] = co_await signals_.async_wait(kUse);
      if (error) co_return;
      if (signal != SIGHUP) break;
      reloader_->reload([](const Result<std::string>&) {});  // the outcome is an event
    }
    notify_stopping();
    line_.stop();
    for (const auto& sensors : sensor_lines_) sensors->line.stop();
    io_.stop();
  }

  // STATUS= once a second; WATCHDOG= only while the line's loop makes progress: data, or a pause that is meant to be.
  asio::awaitable<void> tick() {
    using std::chrono::steady_clock;
    const std::uint64_t half_us = watchdog_half_us();
    const auto period =
        half_us > 0 ? std::min<steady_clock::duration>(std::chrono::microseconds(half_us), std::chrono::seconds(1))
                    : steady_clock::duration(std::chrono::seconds(1));
    std::string shown;
    for (;;) {
      tick_.expires_after(period);
      co_await tick_.async_wait(kUse);
      if (!disk_hangs_) instance_.acquisition.sync();
      watch_disk();
      follow_clock();
      instance_.release_late();
      if (half_us == 0 && !under_systemd_) continue;
      if (std::string now = summary(instance_); now != shown) notify_status(shown = std::move(now));
      const auto& line = setup().config.line;
      const auto patience = std::chrono::duration<double>(line.silence_s + 2 * line.retry_max_s + 2);
      if (half_us > 0 && steady_clock::now() - line_.last_progress() < patience) notify_watchdog();
    }
  }

  asio::io_context io_{BOOST_ASIO_CONCURRENCY_HINT_UNSAFE_IO};  // one thread does all I/O; others only post
  DiskThread disk_;
  DiskThread loader_{
      0, [](const std::string&) {}};  ///< reads the files of a reload: a server that does not respond stops no log
  Instance instance_;
  ArrivalClock clock_;
  GyroPort gyro_;
  LiveLine line_;
  std::vector<std::unique_ptr<SensorLine>> sensor_lines_;
  std::shared_ptr<Reloader> reloader_;
  Rpc rpc_;
  asio::signal_set signals_;
  asio::steady_timer tick_;
  std::unique_ptr<Server> server_;
  bool disk_hangs_ = false;
  const bool under_systemd_ = std::getenv("NOTIFY_SOCKET") != nullptr;
};

}  // namespace

int run_live(const Options& options, pipeline::Setup setup) {
  const auto live = std::make_unique<Live>(options, setup);
  return live->run();
}

}  // namespace prism::daemon
