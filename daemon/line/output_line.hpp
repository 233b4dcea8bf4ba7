// SPDX-License-Identifier: MIT
// A line on which corrected frames leave: opens it, writes without waiting, and measures the latency.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/line/live_line.hpp"
#include "daemon/pipeline/device.hpp"
#include "drivers/transport/transport.hpp"

namespace prism::line {

/// Bytes that the far end does not take wait here. After 100 ms the newest ones win: what waited before them is lost,
/// except the rest of a frame that is partly written. Whatever happens on this line, the input does not wait.
class OutputLine {
 public:
  using Clock = std::chrono::steady_clock;

  /// Opens the output `index` of `device`, which must outlive this. `capture`: null: none.
  OutputLine(boost::asio::io_context& io, pipeline::Device& device, std::size_t index, pipeline::Tell tell,
             std::unique_ptr<pipeline::CaptureSink> capture);
  ~OutputLine() { problems_.forget(fault_key_), problems_.forget(slow_key_); }
  OutputLine(const OutputLine&) = delete;
  OutputLine& operator=(const OutputLine&) = delete;

  /// Writes the bytes that leave because of bytes that were read at `read_at`, with the stamp `arrival_ns`.
  void send(std::span<const std::uint8_t> bytes, Clock::time_point read_at, std::int64_t arrival_ns);
  /// Call once a second.
  void tick();

 private:
  struct Chunk {
    std::vector<std::uint8_t> bytes;
    std::size_t written = 0;
    Clock::time_point read_at;
    std::int64_t arrival_ns = 0;
  };

  bool is_open() const { return status_.state == pipeline::LineState::kReceiving; }
  void wait(boost::asio::steady_timer& timer, Clock::duration duration, void (OutputLine::*then)());
  void listen();
  void proceed();
  void lose(const std::string& why);
  void flush();
  void drop_old();

  boost::asio::io_context& io_;
  const pipeline::Setup::Output setup_;
  const std::string fault_key_, slow_key_, name_;
  pipeline::OutputStatus& status_;
  Problems& problems_;
  const pipeline::Tell tell_;
  const std::unique_ptr<pipeline::CaptureSink> capture_;
  std::unique_ptr<transport::Transport> transport_;
  std::deque<Chunk> waiting_;
  std::uint64_t waits_ = 0;                    ///< handlers of earlier waits have no effect
  boost::asio::steady_timer again_, backlog_;  ///< to open or read again; to write what waits
  RetryPause retry_;
  std::shared_ptr<int> alive_ = std::make_shared<int>();  ///< handlers of a destroyed line have no effect
};

}  // namespace prism::line
