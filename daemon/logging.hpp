// SPDX-License-Identifier: MIT
// Log output of prismd on stderr.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "daemon/socket/event_log.hpp"

namespace prism::daemon {

// Writes messages to stderr on a separate thread, so that a blocked reader does not block the daemon.

/// Writes lines to a descriptor, in order. If the queue is full, lines are dropped, and the next line that is written
/// reports their number. Thread-safe. Only finish() waits for the descriptor.
class MessageThread {
 public:
  static constexpr std::size_t kLines = 1024;

  /// The caller owns the descriptor, which must stay open until the process ends.
  explicit MessageThread(int descriptor);
  /// Does not wait: lines that finish() did not write are lost.
  ~MessageThread();
  MessageThread(const MessageThread&) = delete;
  MessageThread& operator=(const MessageThread&) = delete;

  /// `line`: with its line end.
  void put(std::string line);
  /// Waits until all lines are written, at most `timeout`. Returns false if some are not.
  bool finish(std::chrono::milliseconds timeout);

  std::uint64_t lost() const;

 private:
  // The thread may block in write(2) for ever, so it shares the ownership of its state.
  struct State {
    std::mutex mutex;
    std::condition_variable work, idle;
    std::deque<std::string> lines;
    std::uint64_t lost = 0, lost_total = 0;
    bool busy = false, stop = false;
  };
  static void run(const std::shared_ptr<State>& state, int descriptor);

  const std::shared_ptr<State> state_ = std::make_shared<State>();
};

/// Logs messages of `level` (a name of spdlog) and above. Under systemd, lines have a severity prefix ("<4>") and no
/// time, which the journal adds.
void begin_logging(const std::string& level);

/// Logs an event as one line.
void log_event(const socket::Event& event);

/// Waits at most half a second until all messages are written.
void finish_logging();

}  // namespace prism::daemon
