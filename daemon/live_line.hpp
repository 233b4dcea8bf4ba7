// SPDX-License-Identifier: MIT
// The live serial line: opened, read, watched for silence, and opened again for ever.
#pragma once

#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "daemon/arrival_clock.hpp"
#include "daemon/line_port.hpp"

namespace prism::daemon {

/// One session: from open to the moment the line is lost (error, end of file, silence). Between sessions it pauses,
/// for retry_min_s where no device is there; else doubling up to retry_max_s, and anew from the start once data has
/// come.
class LiveLine {
 public:
  /// `port` and `clock` outlive the line; `alone`: no other line uses the clock.
  LiveLine(boost::asio::io_context& io, Instance& instance, LinePort& port, ArrivalClock& clock, bool alone);

  /// Opens the line, now or as soon as it is there, until stop().
  void start();
  void stop();
  /// Ends the session and opens the line at once, with the settings of then.
  void reopen();

  /// When something last went as it should: data came, or a pause that was meant to be began. For the watchdog.
  std::chrono::steady_clock::time_point last_progress() const { return last_progress_; }
  bool is_open() const { return line_.has_value(); }

 private:
  using Clock = std::chrono::steady_clock;

  boost::asio::awaitable<void> watch();
  void listen();
  void readable();
  void open_or_pause();
  bool open();
  void count_hardware();
  void rest();
  void pause();
  void lose(const char* kind, const std::string& why);
  void complain(const char* kind, const std::string& text);
  void tell(Severity severity, const char* kind, const std::string& text);
  void set(LineState state, const std::string& detail = {});
  void begin_receiving(std::int64_t arrival_ns);

  boost::asio::io_context& io_;
  Instance& instance_;
  LinePort& port_;
  std::optional<boost::asio::posix::stream_descriptor> line_;
  std::uint64_t opening_ = 0;  ///< counts how often the line was opened: a handler of one before does nothing
  boost::asio::steady_timer watch_timer_, pause_timer_;
  ArrivalClock& arrival_;
  const bool alone_;
  Clock::time_point last_data_, last_progress_;
  std::chrono::duration<double> retry_{0};
  bool stopping_ = false, begun_ = false;
  std::string complaint_, complaint_kind_;
  std::array<std::uint8_t, 65536> buffer_;
};

}  // namespace prism::daemon
