// SPDX-License-Identifier: MIT
// Log output of prismd on stderr.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/disk_thread.hpp"
#include "daemon/socket/event_log.hpp"

namespace prism::daemon {

// Writes messages to stderr on a separate thread, so that a blocked reader does not block the daemon.

/// Writes lines to a descriptor, in order. If the queue is full, lines are dropped, and the next line that is written
/// reports their number. Only finish() waits for the descriptor. Not thread-safe.
class MessageThread {
 public:
  static constexpr std::size_t kMostBytes = 256 << 10;

  /// The caller owns the descriptor, which must stay open until the process ends.
  explicit MessageThread(int descriptor) : descriptor_(descriptor) {}

  /// `line`: with its line end.
  void put(const std::string& line);
  /// Waits until all lines are written, at most `timeout`. Returns false if some are not.
  bool finish(std::chrono::milliseconds timeout) { return thread_.drain(timeout); }

 private:
  const int descriptor_;
  std::uint64_t lost_ = 0;
  DiskThread& thread_ = *new DiskThread(kMostBytes, [](const std::string&) {});  ///< never ends: it may be blocked
};

/// Logs messages of `level` (a name of spdlog) and above. Under systemd, lines have a severity prefix ("<4>") and no
/// time, which the journal adds.
void begin_logging(const std::string& level);

/// Logs an event as one line.
void log_event(const socket::Event& event);

/// Waits at most half a second until all messages are written.
void finish_logging();

}  // namespace prism::daemon
