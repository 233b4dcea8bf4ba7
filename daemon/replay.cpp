// SPDX-License-Identifier: MIT
// prismd --replay: processes captures in the same way as a live line.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <memory>
#include <system_error>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/host_time.hpp"
#include "daemon/awaiting.hpp"
#include "daemon/log/row_log.hpp"
#include "daemon/logging.hpp"
#include "daemon/pipeline/captures.hpp"
#include "daemon/pipeline/device.hpp"
#include "daemon/program.hpp"
#include "daemon/socket/server.hpp"
#include "drivers/capture_file.hpp"

namespace prism::daemon {
namespace {

namespace asio = boost::asio;
using Steady = std::chrono::steady_clock;
using pipeline::kGyroLine;

// Maps recorded time to the steady clock: when the packet of `time_ns` is due.
class Pace {
 public:
  explicit Pace(std::optional<double> speed) : speed_(speed) {}
  std::optional<Steady::time_point> due(std::int64_t time_ns) {
    if (!speed_) return std::nullopt;
    if (!first_ns_) first_ns_ = time_ns, begin_ = Steady::now();
    const double seconds = static_cast<double>(time_ns - *first_ns_) * 1e-9 / *speed_;
    return begin_ + std::chrono::duration_cast<Steady::duration>(std::chrono::duration<double>(seconds));
  }

 private:
  std::optional<double> speed_;
  std::optional<std::int64_t> first_ns_;
  Steady::time_point begin_;
};

// "chamber=a.pcap"
Result<pipeline::SensorFiles> named_files(const std::vector<std::string>& named) {
  pipeline::SensorFiles files;
  for (const std::string& one : named) {
    const std::size_t equals = one.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == one.size())
      return make_error("--replay-sensors", fmt::format("found \"{}\", expected LINE=FILE", one));
    files[one.substr(0, equals)].push_back(one.substr(equals + 1));
  }
  return files;
}

void pass(pipeline::Device& device, std::size_t line, const drivers::CapturePacket& packet) {
  if (packet.event == drivers::CaptureEvent::kData) {
    device.feed(line, packet.bytes, packet.time_ns);
  } else if (packet.event == drivers::CaptureEvent::kOpened) {
    device.begin_session(line, packet.time_ns);
  }
}

int fail(const std::string& what) {
  finish_logging();
  fmt::print(stderr, "prismd: {}\n", printable(what));
  return kExitFailed;
}

std::string row(const std::string& stage, std::uint64_t count, const std::string& remark = "") {
  return fmt::format("{:<12}{:>12}{}{}\n", stage, count, remark.empty() ? "" : "   ", remark);
}

// "3 failed their check, 12 missing"; counts of 0 are left out.
std::string losses(std::initializer_list<std::pair<std::uint64_t, const char*>> counts) {
  std::string text;
  for (const auto& [count, what] : counts) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, what);
  }
  return text;
}

// One line per stage, with what was lost there; the stages after the samples by axis.
std::string funnel_text(const pipeline::Device& device) {
  const pipeline::Pipeline& pipeline = *device.pipeline;
  const wire::DecoderCounters& line = pipeline.decoder().counters();
  const drivers::ClockStatus& clock = pipeline.clock().status();
  std::string text = row("bytes", line.bytes, losses({{line.skipped_bytes, "in no frame"}}));
  text += row("frames", line.frames,
              losses({{line.bad_check, "failed their check"},
                      {clock.missing_frames, "missing"},
                      {clock.rejected_counters, "with a wrong counter"}}));
  text += row("samples", clock.samples, losses({{clock.duplicates, "repeat the counter or time of the frame before"}}));
  for (std::size_t i = 0; i < device.axes.size(); ++i) {
    const std::string axis = device.axes.size() > 1 ? " " + device.axes[i].name : "";
    const pipeline::AxisRecord& rows = device.axes[i];
    text += row("rates" + axis, pipeline.axes()[i].rates);
    text += row("seconds" + axis, rows.seconds);
    text += row("windows" + axis, rows.windows, fmt::format("of {} s", device.setup.axes[i].features().length_s));
    text += row("corrected" + axis, rows.corrected, device.setup.axes[i].model ? "" : "no model");
  }
  return text;
}

class Replay {
 public:
  Replay(const Options& options, const pipeline::Setup& setup)
      : options_(options),
        device_(
            setup, log::make_logs(setup, nullptr, disk_problems_, {}, {events_.teller(), false}), {},
            [this](const pipeline::Rows& rows) { publisher_.rows(rows); }, events_.teller(), problems_),
        rpc_({device_, events_, publisher_, host_time_ns()},
             {[](auto done) { done(make_error("reload", "a replay cannot reload its configuration")); }}),
        signals_(io_, SIGINT, SIGTERM),
        timer_(io_) {}

  int run() {
    if (auto opened = open_sensors(); !opened) return fail(opened.error().text());
    if (auto opened = open_frames(); !opened) return fail(opened.error().text());
    if (!options_.overrides.socket.empty()) {
      server_ = std::make_unique<socket::Server>(
          io_, device_.setup.config.socket, publisher_, rpc_,
          [](auto, const std::string&, const std::string& text) { spdlog::warn("{}", text); }, problems_);
      if (const auto listening = server_->listen({}); !listening) return fail(listening.error().text());
      asio::co_spawn(io_, server_->serve(), asio::detached);
    }
    asio::co_spawn(io_, handle_signals(), asio::detached);
    asio::co_spawn(io_, feed_all(), asio::detached);
    const auto begin = Steady::now();
    io_.run();
    const double seconds = std::chrono::duration<double>(Steady::now() - begin).count();
    if (sensors_) {
      for (const std::string& note : sensors_->notes()) spdlog::warn("{}", note);
    }
    if (frames_ && std::fclose(frames_.release()) != 0) fault_ = frames_fault();
    if (!fault_.empty()) return fail(fault_);
    if (!disk_fault_.empty())
      return fail(fmt::format("{}; {} rows lost", disk_fault_, device_.log ? device_.log->dropped.load() : 0));
    if (device_.frames() == 0 && !stopped_) return fail(no_frame());
    if (options_.check) {
      fmt::print("{}", funnel_text(device_));
    } else {
      summarise(seconds);
    }
    return verdict();
  }

 private:
  int verdict() const {
    if (const std::string& clocks = device_.clocks_differed; !clocks.empty()) {
      fail(fmt::format("{}; correct the description, or accept it with --accept-clock", clocks));
      return kExitClock;
    }
    if (!options_.check) return kExitDone;
    if (problems_.has(pipeline::kNoRate)) return fail(problems_.find(pipeline::kNoRate).text);
    for (const pipeline::Axis& axis : device_.pipeline->axes()) {
      if (axis.rates == 0) return fail(fmt::format("found no rate of axis {}, expected at least one", axis.name));
    }
    return kExitDone;
  }

  Result<void> open_sensors() {
    const pipeline::Setup& setup = device_.setup;
    if (setup.sensor_lines.empty() && options_.replay_sensors.empty()) return {};
    auto files = named_files(options_.replay_sensors);
    if (!files) return tl::unexpected<Error>(files.error());
    if (auto good = pipeline::check_sensor_files(setup, *files); !good) return good;
    if (files->empty()) *files = pipeline::sensor_files_beside(setup, options_.replay.front());
    if (auto failed = take(sensors_, pipeline::SensorCaptures::open(setup, *files))) return *failed;
    return {};
  }

  Result<void> open_frames() {
    const std::string& path = options_.out_frames;
    if (path.empty()) return {};
    if (device_.outputs.empty())
      return make_error("--out-frames", "found no \"out\" in " + device_.setup.config.path + ", expected an output");
    if (auto failed = take(frames_, open_output_stream(path))) return *failed;
    device_.send_by([this](std::size_t output, std::span<const std::uint8_t> bytes) {
      if (output > 0 || !frames_ || std::fwrite(bytes.data(), 1, bytes.size(), frames_.get()) == bytes.size()) return;
      fault_ = frames_fault();
    });
    return {};
  }
  std::string frames_fault() const {
    return fmt::format("{}: cannot be written: {}", options_.out_frames,
                       std::error_code(errno, std::generic_category()).message());
  }

  void set_lines(pipeline::LineState state, const std::string& detail) {
    for (std::size_t i = 0; i < device_.lines.size(); ++i) device_.lines[i].set(state, detail, host_time_ns());
  }

  asio::awaitable<void> handle_signals() {
    co_await signals_.async_wait(kUse);
    stopped_ = true;
    timer_.cancel();
  }

  asio::awaitable<void> feed_all() {
    set_lines(pipeline::LineState::kReplaying, "");
    for (const std::string& file : options_.replay) {
      co_await feed_file(file);
      if (!fault_.empty() || stopped_) break;
    }
    device_.finish(kGyroLine);
    device_.lines[kGyroLine].set(pipeline::LineState::kEnded, "the replay is over", host_time_ns());
    io_.stop();
  }

  asio::awaitable<void> feed_file(const std::string& file) {
    Result<drivers::CaptureReader> reader = pipeline::open_capture(file, *device_.setup.frames);
    if (!reader) {
      fault_ = reader.error().text();
      co_return;
    }
    constexpr int kSlice = 4096;  // packets between two checks of sockets and signals
    const pipeline::SensorCaptures::Give give = [this](std::size_t line, const drivers::CapturePacket& sensors) {
      pass(device_, kGyroLine + 1 + line, sensors);
    };
    Pace pace(options_.speed);
    for (int count = 1;; ++count) {
      const std::optional<drivers::CapturePacket> packet = reader->next();
      if (!packet || stopped_) break;
      if (const auto due = pace.due(packet->time_ns); due && *due > Steady::now()) {
        timer_.expires_at(*due);
        co_await timer_.async_wait(kUse);
      } else if (count % kSlice == 0) {
        co_await asio::post(io_, kUse);
      }
      if (sensors_) sensors_->until(*packet, give);
      pass(device_, kGyroLine, *packet);
    }
    if (const std::string damage = reader->damaged_places().text(); !damage.empty())
      spdlog::warn("{}: {}; skipped, and the rest of the capture was read", file, damage);
    if (!reader->tail_damage().empty()) spdlog::warn("{}", reader->tail_damage());
    if (reader->foreign_packets() > 0)
      spdlog::warn("{}: skipped {} packets without a serial record", file, reader->foreign_packets());
  }

  std::string no_frame() const {
    return fmt::format(
        "{}: found no frame of \"{}\" in {} bytes, expected at least one; prismd --sniff {} prints which description "
        "fits",
        fmt::join(options_.replay, ", "), device_.setup.frames->name, device_.decoded(kGyroLine).bytes,
        shell_word(options_.replay.front()));
  }

  void summarise(double seconds) const {
    const auto& line = device_.decoded(kGyroLine);
    const drivers::ClockStatus& clock = device_.pipeline->clock().status();
    fmt::print(
        "replayed {} frames in {:.2f} s ({:.2f} million/s), {} failed their check, {} missing{}, {} bytes skipped\n",
        line.frames, seconds, static_cast<double>(line.frames) / std::max(seconds, 1e-9) / 1e6, line.bad_check,
        clock.missing_frames,
        clock.missing_by_arrival > 0 ? fmt::format(" ({} of them by arrival times)", clock.missing_by_arrival) : "",
        line.skipped_bytes);
    if (stopped_) fmt::print("stopped before the end of the capture\n");
    if (const pipeline::LogCounters* log = device_.log)
      fmt::print("log: {} rows in {}\n", log->rows.load(), device_.setup.config.log->directory);
    for (const pipeline::AxisRecord& axis : device_.axes) {
      fmt::print("{}", axis.prefix);
      summarise(axis.stability);
    }
  }

  static void summarise(const compensation::BlockStability& blocks) {
    const auto improvement = blocks.improvement();
    if (!improvement) {
      fmt::print(
          "bias stability: none: found {} corrected means, expected two or more (no model, or a short capture)\n",
          blocks.raw().count());
      return;
    }
    fmt::print(
        "bias stability (1 sigma of {} means, divisor N-1): raw {:.5f} deg/h, corrected {:.5f} deg/h, improvement "
        "{:.2f} %\n",
        blocks.raw().count(), blocks.raw().sd(), blocks.corrected().sd(), 100 * *improvement);
  }

  asio::io_context io_{1};
  Options options_;
  std::string disk_fault_;  ///< the first one
  Problems disk_problems_{[this](bool begins, const std::string&, const std::string& text) {
    if (begins && disk_fault_.empty()) disk_fault_ = text;
  }};
  socket::Publisher publisher_;
  socket::EventLog events_{[this](const socket::Event& event) {
    if (event.kind != "quality") log_event(event);  // each row of the log contains it
    publisher_.event(event);
  }};
  Problems problems_{pipeline::problems_as_events(events_.teller())};
  pipeline::Device device_;
  socket::Rpc rpc_;
  std::unique_ptr<socket::Server> server_;
  asio::signal_set signals_;
  asio::steady_timer timer_;
  std::optional<pipeline::SensorCaptures> sensors_;
  Stream frames_;
  std::string fault_;
  bool stopped_ = false;
};

}  // namespace

int run_replay(const Options& options, pipeline::Setup setup) {
  for (const std::string& file : options.replay) {
    const auto reader = pipeline::open_capture(file, *setup.frames);
    if (!reader) return fail(reader.error().text());
    if (const auto used = pipeline::use_time_of(*reader, file, setup); !used) return fail(used.error().text());
  }
  if (options.check) setup.config.log.reset();
  return std::make_unique<Replay>(options, setup)->run();
}

}  // namespace prism::daemon
