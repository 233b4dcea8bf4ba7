// SPDX-License-Identifier: MIT
// A live line: opens, reads and reopens a line to a device until it is stopped.
#pragma once

#include <algorithm>
#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/pipeline/device.hpp"
#include "drivers/commands.hpp"
#include "drivers/transport/transport.hpp"

namespace prism::line {

// Monotonic arrival times in UTC.

/// One for all lines of an instance. now_ns() = CLOCK_MONOTONIC + an offset taken from CLOCK_REALTIME at begin(). If
/// the host clock is set during a session, only check() follows it, and only a step of more than half a second.
class ArrivalClock {
 public:
  ArrivalClock() { begin(); }

  void begin();
  /// ns since 1970 UTC. Never decreases between begin() and a step that check() follows.
  std::int64_t now_ns() const { return at(std::chrono::steady_clock::now()); }
  std::int64_t at(std::chrono::steady_clock::time_point time) const {
    return std::chrono::nanoseconds(time.time_since_epoch()).count() + offset_ns_;
  }
  /// Time stamp of bytes read at `time`: always later than the previous stamp.
  std::int64_t stamp(std::chrono::steady_clock::time_point time) { return last_ns_ = std::max(at(time), last_ns_ + 1); }
  /// Call about once a second. Returns the step in ns if the host clock was set, else 0.
  std::int64_t check();

 private:
  std::int64_t offset_ns_ = 0, last_ns_ = 0;
};

/// Pauses before a line is opened again: retry_min_s while the device is absent, so that it is used soon after it is
/// back; for one that exists but fails, doubled up to retry_max_s.
class RetryPause {
 public:
  void reset() { next_s_ = 0; }
  std::chrono::steady_clock::duration next(const config::LineConfig& line, bool is_there) {
    const double now_s = is_there ? std::max(next_s_, line.retry_min_s) : line.retry_min_s;
    next_s_ = is_there ? std::min(2 * now_s, line.retry_max_s) : 0;
    return std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(now_s));
  }

 private:
  double next_s_ = 0;
};

/// A line that opens slowly, through a network, is open only when its transport is. A session lasts from open until the
/// line is lost (error, end of file, no data for silence_s). Between sessions it pauses: for retry_min_s if the device
/// does not exist; else the pause doubles up to retry_max_s and is reset when a frame arrives. After an opening it
/// sends the start-up commands, then polls; at the end the stop commands.
class LiveLine {
 public:
  /// `number`: of the line in the device. `device` and `clock` must outlive this. `alone`: no other line uses
  /// the clock.
  LiveLine(boost::asio::io_context& io, pipeline::Device& device, std::size_t number, ArrivalClock& clock, bool alone,
           pipeline::Tell tell);

  /// Opens the line now or as soon as the device exists, until stop().
  void start();
  void stop();
  /// Sends the stop commands, if there are any and the line is open; is_stopping() is false when they are done.
  void begin_stop();
  bool is_stopping() const { return stopping_ && open_ && open_->steps; }
  /// Sends bytes to the device. Errors: not allowed by the configuration, the line is not open.
  Result<void> send(std::span<const std::uint8_t> bytes);
  /// Ends the session and opens the line at once, with the current settings.
  void reopen();

  /// Time of the last data or end of the planned pause. For the watchdog.
  std::chrono::steady_clock::time_point last_progress() const { return last_progress_; }
  bool is_open() const { return open_ && open_->is_ready; }

 private:
  using Clock = std::chrono::steady_clock;

  struct Open {
    std::unique_ptr<transport::Transport> transport;
    bool is_ready = false;                  ///< the transport has been opened
    std::optional<drivers::StartUp> steps;  ///< start-up or stop commands that are not done
    std::vector<std::uint8_t> unsent;
  };

  boost::asio::awaitable<void> watch();
  void listen();
  void readable();
  void open();
  void proceed(const transport::Received& received);
  void opened();
  void not_opened(const std::string& why);
  void count_hardware();
  void rest();
  void pause();
  void lose(const std::string& kind, const std::string& why,
            pipeline::LineState state = pipeline::LineState::kConnecting);
  void complain(const std::string& kind, const std::string& text);
  /// Of texts: a sensor line's begin with its name.
  std::string prefix() const;
  void tell(pipeline::Severity severity, const char* kind, const std::string& text);
  /// All faults of a network line until the next data are one: it was lost, refused and not answered.
  bool continues_fault() const { return !fault_kind().empty() && transport::needs_network(settings()); }
  /// Empty: data come, or were never expected yet.
  std::string fault_kind() const { return device_.problems.find(fault_key_).kind; }
  void set(pipeline::LineState state, const std::string& detail = {});
  void start_device();
  void started();
  bool is_starting() const { return !stopping_ && open_->steps; }
  bool polls() const { return poller_ && !stopping_; }
  void answered(std::span<const std::uint8_t> bytes, std::uint64_t frames);
  void converse();
  void converse_by_steps(Clock::time_point now);
  Result<void> put(std::span<const std::uint8_t> bytes);
  void converse_at(Clock::time_point when);
  void begin_receiving(std::int64_t arrival_ns);
  void receiving();
  void frames_came();
  void watch_frames(Clock::duration silence);
  bool watch_peers(Clock::duration silence);
  void remember(std::span<const std::uint8_t> bytes);
  void watch_doubled(std::span<const std::uint8_t> bytes);
  void suspect_telnet(const std::string& why);
  std::string heard_instead() const;

  const config::LineConfig& config() const { return device_.setup.line_config(number_); }
  const transport::Settings& settings() const { return device_.setup.line_settings(number_); }
  pipeline::LineStatus& status() { return device_.lines[number_]; }

  boost::asio::io_context& io_;
  pipeline::Device& device_;
  const std::size_t number_;
  const pipeline::Tell tell_;
  std::optional<Open> open_;
  std::uint64_t waits_ = 0, openings_ = 0;  ///< handlers of earlier ones have no effect
  boost::asio::steady_timer watch_timer_, pause_timer_, command_timer_;
  ArrivalClock& arrival_;
  const bool alone_;
  Clock::time_point last_data_, last_progress_, last_frame_;
  RetryPause retry_;
  bool stopping_ = false, begun_ = false;
  const std::string fault_key_, peer_key_;  ///< of the device's problems
  std::optional<drivers::Poller> poller_;   ///< of all openings
  std::uint64_t frames_ = 0;                ///< at last_frame_
  std::string heard_;                       ///< the first bytes since it was opened, until a frame comes
  std::optional<std::uint64_t> telnet_;     ///< TCP, and each byte FF came twice since it was opened: how often
  std::size_t ff_run_ = 0;                  ///< bytes FF before the next byte
  std::uint64_t resyncs_ = 0;               ///< of the decoder when it was opened
  bool framed_ = false;                     ///< a frame came since it was opened
  Clock::time_point opened_at_, turned_away_at_;
  std::array<std::uint8_t, 65536> buffer_;
};

}  // namespace prism::line
