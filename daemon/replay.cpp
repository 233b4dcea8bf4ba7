// SPDX-License-Identifier: MIT
// prismd --replay: captures through the same instance as live.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cmath>
#include <memory>
#include <utility>

#include "base/text_number.hpp"
#include "daemon/arrival_clock.hpp"
#include "daemon/awaiting.hpp"
#include "daemon/logging.hpp"
#include "daemon/pipeline/sensor_captures.hpp"
#include "daemon/server.hpp"
#include "daemon/service.hpp"
#include "drivers/capture_file.hpp"

namespace prism::daemon {
namespace {

namespace asio = boost::asio;
using Steady = std::chrono::steady_clock;

// Virtual time against the steady clock: when the packet of `time_ns` is due.
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
      return refuse("--replay-sensors", fmt::format("found \"{}\", expected LINE=FILE", one));
    files[one.substr(0, equals)].push_back(one.substr(equals + 1));
  }
  return files;
}

void pass_sensors(Instance& instance, std::size_t line, const drivers::CapturePacket& packet) {
  instance.sensor_lines[line].last_data_ns = packet.time_ns;
  if (packet.event == drivers::CaptureEvent::kData) {
    instance.acquisition.feed_sensors(line, packet.bytes, packet.time_ns);
  } else if (packet.event == drivers::CaptureEvent::kOpened) {
    instance.acquisition.begin_sensor_session(line, packet.time_ns);
  }
}

void pass(Instance& instance, const drivers::CapturePacket& packet) {
  if (packet.event == drivers::CaptureEvent::kData) {
    instance.feed(packet.bytes, packet.time_ns);
  } else if (packet.event == drivers::CaptureEvent::kOpened) {
    instance.begin_session(packet.time_ns);
  }
}

// The frames of whole seconds of arrival, for a clock that goes by it: a rate_hz that is far off may leave no row at
// all.
class ArrivalRate {
 public:
  explicit ArrivalRate(const pipeline::Setup& setup)
      : watch_(setup.frames->rate_hz),
        applies_(setup.clock.source == drivers::ClockSource::kHost && setup.frames->kinds.size() == 1) {}
  /// `frames` have come when what arrived at time_ns was read.
  std::optional<std::string> arrived(std::int64_t time_ns, std::uint64_t frames) {
    const std::int64_t second = time_ns / compensation::kNanosecondsPerSecond;
    std::optional<std::string> wrong;
    if (applies_ && second != second_) {
      if (whole_ && second == second_ + 1) wrong = watch_.push(static_cast<std::uint32_t>(frames - frames_));
      whole_ = second == second_ + 1;
      second_ = second;
      frames_ = frames;
    }
    return wrong;
  }

 private:
  RateWatch watch_;
  bool applies_, whole_ = false;
  std::int64_t second_ = -1;
  std::uint64_t frames_ = 0;
};

class Replay {
 public:
  Replay(const Options& options, pipeline::Setup setup)
      : options_(options), signals_(io_, SIGINT, SIGTERM), timer_(io_) {
    const auto counters = std::make_shared<LogCounters>();
    auto logs = make_logs(setup, [&](config::SegmentSettings settings, std::string name, std::string metadata) {
      auto rows =
          std::make_unique<DirectRowWriter>(std::move(settings), std::move(name), std::move(metadata), counters);
      rows_.push_back(rows.get());
      return rows;
    });
    rate_ = std::make_unique<ArrivalRate>(setup);
    instance_ = std::make_unique<Instance>(std::move(setup), std::move(logs), nullptr, [](const Event& event) {
      if (event.kind != "quality") log_event(event);  // the log itself says it of each row
    });
    rpc_ = std::make_unique<Rpc>(*instance_,
                                 [](auto done) { done(refuse("reload", "a replay keeps its configuration")); });
  }

  int run() {
    if (auto opened = open_sensors(); !opened) return fail(opened.error().text());
    if (!options_.socket.empty()) {
      auto server = Server::open(io_, instance_->acquisition.setup().config.socket, -1, *instance_, *rpc_);
      if (!server) return fail(server.error().text());
      server_ = std::move(*server);
      asio::co_spawn(io_, server_->serve(), asio::detached);
    }
    asio::co_spawn(io_, heed_signals(), asio::detached);
    asio::co_spawn(io_, feed_all(), asio::detached);
    const auto begin = Steady::now();
    io_.run();
    const double seconds = std::chrono::duration<double>(Steady::now() - begin).count();
    if (sensors_) {
      for (const std::string& note : sensors_->notes()) spdlog::warn("{}", note);
    }
    if (!fault_.empty()) return fail(fault_);
    for (const DirectRowWriter* rows : rows_) {
      if (!rows->first_fault().empty()) return fail(rows->first_fault());
    }
    if (instance_->acquisition.frames() == 0 && !stopped_) return fail(no_frame());
    summarise(seconds);
    return kExitDone;
  }

 private:
  static int fail(const std::string& what) {
    spdlog::error("{}", what);
    return kExitFailed;
  }

  Result<void> open_sensors() {
    const pipeline::Setup& setup = instance_->acquisition.setup();
    if (setup.sensor_lines.empty() && options_.replay_sensors.empty()) return {};
    auto files = named_files(options_.replay_sensors);
    if (!files) return tl::unexpected<Error>(files.error());
    if (files->empty()) *files = pipeline::sensor_files_beside(setup, options_.replay.front());
    auto opened = pipeline::SensorCaptures::open(setup, *files);
    if (!opened) return tl::unexpected<Error>(opened.error());
    sensors_.emplace(std::move(*opened));
    return {};
  }

  asio::awaitable<void> heed_signals() {
    co_await signals_.async_wait(kUse);
    stopped_ = true;
    timer_.cancel();
  }

  asio::awaitable<void> feed_all() {
    instance_->set_line(LineState::kReplaying);
    for (LineStatus& line : instance_->sensor_lines) line.set(LineState::kReplaying, "", host_time_ns());
    for (const std::string& file : options_.replay) {
      co_await feed_file(file);
      if (!fault_.empty() || stopped_) break;
    }
    instance_->finish();
    instance_->set_line(LineState::kEnded, "the replay is over");
    io_.stop();
  }

  asio::awaitable<void> feed_file(const std::string& file) {
    const wire::FrameDescription& frames = *instance_->acquisition.setup().frames;
    const drivers::BareBytes bare{std::max(frames.rate_hz * frames.max_frame_bytes, 1.0), 0};
    Result<drivers::CaptureReader> reader = drivers::CaptureReader::open(file, bare);
    if (!reader) {
      fault_ = reader.error().text();
      co_return;
    }
    constexpr int kSlice = 4096;  // packets between two looks at sockets and signals
    const pipeline::SensorCaptures::Give give = [this](std::size_t line, const drivers::CapturePacket& sensors) {
      pass_sensors(*instance_, line, sensors);
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
      pass(*instance_, *packet);
      if (!reader->is_bare()) watch_rate(packet->time_ns);
    }
    if (const std::string damage = reader->damaged_places().text(); !damage.empty())
      spdlog::warn("{}: {}; the capture was read on behind", file, damage);
    if (!reader->tail_damage().empty()) spdlog::warn("{}", reader->tail_damage());
    if (reader->foreign_packets() > 0)
      spdlog::warn("{}: {} packets hold no serial record and were left out", file, reader->foreign_packets());
  }

  void watch_rate(std::int64_t time_ns) {
    const auto wrong = rate_->arrived(time_ns, instance_->acquisition.frames());
    if (wrong) spdlog::warn("{}: {}", instance_->acquisition.setup().frames->name, *wrong);
  }

  std::string no_frame() const {
    const Acquisition& s = instance_->acquisition;
    return fmt::format("{}: found no frame of \"{}\" in {} bytes, expected some: prismd --sniff {} says what fits",
                       fmt::join(options_.replay, ", "), s.setup().frames->name,
                       s.pipeline().decoder().counters().bytes, options_.replay.front());
  }

  void summarise(double seconds) const {
    const Acquisition& s = instance_->acquisition;
    const auto& line = s.pipeline().decoder().counters();
    const drivers::ClockStatus& clock = s.pipeline().clock().status();
    fmt::print(
        "replayed {} frames in {:.2f} s ({:.2f} million/s), {} failed their check, {} missing{}, {} bytes skipped\n",
        line.frames, seconds, static_cast<double>(line.frames) / std::max(seconds, 1e-9) / 1e6, line.bad_check,
        clock.missing_frames,
        clock.missing_by_arrival > 0 ? fmt::format(" ({} of them by arrival times)", clock.missing_by_arrival) : "",
        line.skipped_bytes);
    if (stopped_) fmt::print("stopped before the end of the capture\n");
    if (const LogCounters* log = s.log())
      fmt::print("log: {} rows in {}\n", log->rows.load(), s.setup().config.log->directory);
    for (std::size_t i = 0; i < s.axes(); ++i) {
      fmt::print("{}", s.axis_prefix(i));
      summarise(s.record(i).stability());
    }
  }

  static void summarise(const compensation::BlockStability& blocks) {
    const auto improvement = blocks.improvement();
    if (!improvement) {
      fmt::print("bias stability: unknown, it needs two full blocks with a correction, found {}\n",
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
  std::vector<DirectRowWriter*> rows_;
  std::unique_ptr<Instance> instance_;
  std::unique_ptr<Rpc> rpc_;
  std::unique_ptr<Server> server_;
  asio::signal_set signals_;
  asio::steady_timer timer_;
  std::unique_ptr<ArrivalRate> rate_;
  std::optional<pipeline::SensorCaptures> sensors_;
  std::string fault_;
  bool stopped_ = false;
};

}  // namespace

int run_replay(const Options& options, pipeline::Setup setup) {
  return std::make_unique<Replay>(options, std::move(setup))->run();
}

}  // namespace prism::daemon
