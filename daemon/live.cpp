// SPDX-License-Identifier: MIT
// prismd with a live gyro.
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <optional>
#include <span>
#include <utility>

#include "base/host_time.hpp"
#include "base/notify.hpp"
#include "base/time_scale.hpp"
#include "daemon/awaiting.hpp"
#include "daemon/line/live_line.hpp"
#include "daemon/line/output_line.hpp"
#include "daemon/log/capture_log.hpp"
#include "daemon/log/row_log.hpp"
#include "daemon/logging.hpp"
#include "daemon/program.hpp"
#include "daemon/reloader.hpp"
#include "daemon/socket/answers.hpp"
#include "daemon/socket/rpc.hpp"
#include "daemon/socket/server.hpp"

namespace prism::daemon {
namespace {

namespace asio = boost::asio;
using pipeline::kGyroLine;
using pipeline::Severity;
constexpr std::size_t kDiskQueueBytes = 4 << 20;
constexpr std::chrono::seconds kDiskTimeout{3};
constexpr std::chrono::milliseconds kExitTimeout{3500};
constexpr std::chrono::milliseconds kStopStep{10};  // the lines' stop commands take at most a second
constexpr int kStopSteps = 100;

class Live {
 public:
  Live(const Options& options, const pipeline::Setup& setup)
      : disk_(kDiskQueueBytes, [tell = teller()](const std::string& what) { tell(Severity::kWarning, "disk", what); }),
        device_(
            setup,
            log::make_logs(setup, &disk_, problems_,
                           {[this] { asio::post(io_, [this] { publisher_.rows_written(); }); },
                            [this] { asio::post(io_, [this] { rpc_.synced(); }); }},
                           segment_policy()),
            make_captures(setup),
            [this](const pipeline::Rows& rows) {
              publisher_.rows(rows, device_.log != nullptr && device_.log->pending > 0);
            },
            tell_, problems_),
        reloader_(std::make_shared<Reloader>(
            io_, loader_,
            Reloader::Parts{[path = options.config, overrides = options.overrides] {
                              auto loaded = pipeline::load_setup(path, overrides);
                              if (loaded) loaded->loaded_ns = host_time_ns();
                              return loaded;
                            },
                            device_,
                            [this] {
                              for (const auto& line : lines_) line->reopen();
                            },
                            [this] { open_outputs(); }, tell_, [this] { return socket::summary(sources()); }})),
        rpc_(sources(),
             {[this](Reloader::Done done) { reloader_->reload(std::move(done)); },
              [this](std::size_t line, std::span<const std::uint8_t> bytes) { return lines_[line]->send(bytes); },
              [this](std::size_t axis, std::optional<pipeline::Offset> offset, socket::Rpc::Done done) {
                set_offset(axis, std::move(offset), std::move(done));
              }}),
        signals_(io_, SIGINT, SIGTERM, SIGHUP),
        tick_(io_),
        stop_timer_(io_) {
    for (std::size_t i = 0; i < device_.lines.size(); ++i) {
      device_.lines[i].since_ns = started_ns_;
      const bool alone = device_.lines.size() == 1;
      lines_.push_back(std::make_unique<line::LiveLine>(io_, device_, i, clock_, alone, tell_));
    }
  }

  int run() {
    const config::Config& config = setup().config;
    const std::optional<int> inherited = inherited_socket();
    if (!config.socket.path.empty() || inherited) {
      server_ = std::make_unique<socket::Server>(io_, config.socket, publisher_, rpc_, tell_, problems_);
      if (const auto listening = server_->listen(inherited); !listening) {
        spdlog::error(listening.error().text());
        return kExitFailed;
      }
      asio::co_spawn(io_, server_->serve(), asio::detached);
    }
    for (const std::string& key : setup().config.removed_keys) tell_(Severity::kWarning, "removed_key", key);
    for (const std::string& note : setup().notes) tell_(Severity::kInfo, "note", note);
    report_missing_models();
    restore_offsets();
    device_.send_by([this](std::size_t output, std::span<const std::uint8_t> bytes) {
      const auto& gyro = lines_[kGyroLine];
      outputs_[output]->send(bytes, gyro->last_progress(), device_.lines[kGyroLine].last_data_ns);
    });
    open_outputs();
    for (auto line = lines_.rbegin(); line != lines_.rend(); ++line) (*line)->start();  // the gyro's line last
    asio::co_spawn(io_, handle_signals(), asio::detached);
    asio::co_spawn(io_, tick(), asio::detached);
    notify_ready(socket::summary(sources()));
    io_.run();
    notify_stopping();
    device_.finish(kGyroLine);
    outputs_.clear();
    return end_disk();
  }

 private:
  socket::Sources sources() { return {device_, events_, publisher_, started_ns_}; }

  // Again after a reload that changed the outputs.
  void open_outputs() {
    outputs_.clear();
    device_.output_lines = std::vector<pipeline::OutputStatus>(device_.outputs.size());
    for (std::size_t i = 0; i < device_.outputs.size(); ++i) {
      std::unique_ptr<pipeline::CaptureSink> capture;
      if (setup().outputs[i].config.capture) capture = make_capture(setup(), fmt::format("out-{}", i + 1));
      outputs_.push_back(std::make_unique<line::OutputLine>(io_, device_, i, tell_, std::move(capture)));
    }
  }

  // Once a minute; prismcal monitor runs once a day.
  void read_verdicts() {
    constexpr int kTicks = 60;
    const std::string path = pipeline::monitor_file(setup().config);
    if (path.empty() || ticks_++ % kTicks != 0 || loader_.busy_for().count() > 0) return;
    loader_.post(0, [this, path] {
      asio::post(io_, [this, verdicts = pipeline::read_verdicts(path)] { device_.take_verdicts(verdicts); });
    });
  }

  // If the gyro's line is closed (and is the only line), its next session takes the new clock.
  void follow_clock() {
    const std::int64_t step = lines_[kGyroLine]->is_open() || lines_.size() > 1 ? clock_.check() : 0;
    if (step == 0) return;
    tell_(Severity::kWarning, "host_clock",
          fmt::format("host clock stepped by {:+.3f} s; window restarted", static_cast<double>(step) * 1e-9));
    const std::int64_t now_ns = clock_.now_ns();
    device_.clock_set(now_ns - step, now_ns);
  }

  void report_missing_models() {
    for (std::size_t i = 0; i < device_.axes.size(); ++i) {
      const pipeline::Setup::Axis& axis = setup().axes[i];
      if (axis.model) continue;
      const std::string prefix = device_.axes[i].prefix;
      if (axis.model_problem.empty()) {
        tell_(Severity::kWarning, "no_model",
              prefix + "no model is configured: rates are published uncorrected and marked no_model");
      } else {
        tell_(Severity::kError, "no_model",
              fmt::format("{}{}; rates are recorded uncorrected and marked no_model until a reload", prefix,
                          axis.model_problem));
      }
    }
  }

  // Stored before it is in force, so that a restart cannot lose it.
  void set_offset(std::size_t axis, std::optional<pipeline::Offset> offset, socket::Rpc::Done done) {
    const std::string path = offset_path(setup(), axis);
    if (path.empty()) return done(make_error("offset", "no log is written, expected one: it records the offset"));
    if (auto good = offset ? bind_offset(setup().axes[axis].model, *offset) : Result<void>(); !good)
      return done(tl::unexpected<Error>(good.error()));
    const auto stored = [this, axis, offset, done](const Result<void>& result) {
      asio::post(io_, [this, axis, offset, done, result] {
        if (!result) return done(tl::unexpected<Error>(result.error()));
        device_.use_offset(axis, offset, offset ? "set" : "cleared");
        done(offset ? pipeline::offset_text(*offset) : "none");
      });
    };
    disk_.post(
        0, [path, offset, stored] { stored(pipeline::store_offset(path, offset)); },
        [path, stored](const std::string& why) { stored(make_error(path, why)); });
  }

  // One that has expired ends at the first tick.
  void restore_offsets() {
    device_.call_at_end_of_offsets([this](std::size_t axis, const pipeline::Offset& ended) {
      disk_.post(0, [path = offset_path(setup(), axis), ended] { pipeline::forget_offset(path, ended); });
    });
    for (std::size_t i = 0; i < device_.axes.size(); ++i) {
      const auto found = pipeline::load_offset(offset_path(setup(), i));
      if (!found) tell_(Severity::kError, "offset", "not restored: " + found.error().text());
      if (found && *found) device_.use_offset(i, *found, "restored");
    }
  }

  // A blocked disk does not delay the exit: prismd logs the unwritten rows and exits.
  int end_disk() {
    const pipeline::LogCounters* const log = device_.log;
    device_.close();
    const bool done = disk_.drain(kExitTimeout);
    publisher_.release();
    if (done && loader_.drain(kExitTimeout)) return kExitDone;
    if (done) {
      spdlog::error("reload: a file server does not respond; exiting without the reload");
      finish_logging();
      ::_exit(kExitDone);
    }
    spdlog::error(fmt::format("the disk does not respond: {} rows were not written, and {} more are not synced",
                              log ? log->pending.load() : 0, log ? log->unsynced.load() : 0));
    finish_logging();
    ::_exit(kExitFailed);
  }

  // A blocked disk returns no error.
  void watch_disk() {
    using std::chrono::seconds;
    const auto busy = std::chrono::duration_cast<seconds>(disk_.busy_for());
    if (busy < kDiskTimeout) return problems_.clear(pipeline::kDiskBlocked, "the disk answers again");
    const pipeline::LogCounters* const log = device_.log;
    problems_.set(pipeline::kDiskBlocked, {.kind = "disk",
                                           .level = Problem::Level::kFailed,
                                           .text = fmt::format("the disk has not answered for {} s; {} rows wait",
                                                               busy.count(), log ? log->pending.load() : 0)});
  }

  const pipeline::Setup& setup() const { return device_.setup; }

  // Tells on the live thread what another thread found.
  pipeline::Tell teller() {
    return [this](Severity severity, const std::string& kind, const std::string& text) {
      asio::dispatch(io_, [this, severity, kind, text] { tell_(severity, kind, text); });
    };
  }
  log::SegmentPolicy segment_policy() {
    log::SegmentPolicy policy;
    policy.notice_s = scaled_s(policy.notice_s);
    policy.tell = teller();
    return policy;
  }

  // One directory per line: a capture directory contains one line only.
  std::vector<std::unique_ptr<pipeline::CaptureSink>> make_captures(const pipeline::Setup& setup) {
    std::vector<std::unique_ptr<pipeline::CaptureSink>> captures;
    if (!setup.config.capture) return captures;
    captures.push_back(make_capture(setup, ""));
    for (const auto& line : setup.sensor_lines) captures.push_back(make_capture(setup, line.name));
    return captures;
  }
  std::unique_ptr<pipeline::CaptureSink> make_capture(const pipeline::Setup& setup, const std::string& line) {
    config::LogSegmentSettings settings = *setup.config.capture;
    std::string name = setup.config.name;
    if (!line.empty()) settings.directory += "/" + line, name += "-" + line;
    return std::make_unique<log::CaptureLog>(std::move(settings), name, disk_, problems_, log::CaptureLog::kMostHeld,
                                             segment_policy());
  }

  asio::awaitable<void> handle_signals() {
    for (;;) {
      auto [error, signal] = co_await signals_.async_wait(kUse);
      if (error) co_return;
      if (signal != SIGHUP) break;
      reloader_->reload([](const Result<std::string>&) {});  // the result is an event
    }
    notify_stopping();
    for (const auto& line : lines_) line->begin_stop();
    const auto stopping = [](const auto& line) { return line->is_stopping(); };
    for (int i = 0; i < kStopSteps && std::any_of(lines_.begin(), lines_.end(), stopping); ++i) {
      stop_timer_.expires_after(kStopStep);
      co_await stop_timer_.async_wait(kUse);
    }
    for (const auto& line : lines_) line->stop();
    io_.stop();
  }

  // Sends STATUS= once a second, and WATCHDOG= only while the line makes progress: data, or a planned pause.
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
      if (!problems_.has(pipeline::kDiskBlocked)) device_.sync();
      watch_disk();
      device_.end_offsets(host_time_ns() / 1'000'000'000, uptime_s());
      events_.tell_late();
      follow_clock();
      read_verdicts();
      publisher_.release_late();
      for (const auto& output : outputs_) output->tick();
      if (server_) server_->watch_file();
      if (half_us == 0 && !under_systemd_) continue;
      if (std::string now = socket::summary(sources()); now != shown) notify_status(shown = std::move(now));
      const auto& line = setup().config.line;
      const auto timeout = std::chrono::duration<double>(line.silence_s + 2 * line.retry_max_s + 2);
      if (half_us > 0 && steady_clock::now() - lines_[kGyroLine]->last_progress() < timeout) notify_watchdog();
    }
  }

  asio::io_context io_{BOOST_ASIO_CONCURRENCY_HINT_UNSAFE_IO};  // one thread does all I/O; the others only post
  Problems problems_{pipeline::problems_as_events(teller())};
  DiskThread disk_;
  DiskThread loader_{
      0, [](const std::string&) {}};  ///< reads the files of a reload: a server that does not respond stops no log
  const std::int64_t started_ns_ = host_time_ns();
  socket::Publisher publisher_;
  socket::EventLog events_{[this](const socket::Event& event) {
    log_event(event);
    publisher_.event(event);
  }};
  const pipeline::Tell tell_ = events_.teller();
  pipeline::Device device_;
  line::ArrivalClock clock_;
  std::vector<std::unique_ptr<line::LiveLine>> lines_;      ///< in the device's order
  std::vector<std::unique_ptr<line::OutputLine>> outputs_;  ///< as Device::outputs
  std::shared_ptr<Reloader> reloader_;
  socket::Rpc rpc_;
  asio::signal_set signals_;
  asio::steady_timer tick_, stop_timer_;
  int ticks_ = 0;
  std::unique_ptr<socket::Server> server_;
  const bool under_systemd_ = std::getenv("NOTIFY_SOCKET") != nullptr;
};

}  // namespace

int run_live(const Options& options, pipeline::Setup setup) {
  const auto live = std::make_unique<Live>(options, setup);
  return live->run();
}

}  // namespace prism::daemon
