// SPDX-License-Identifier: MIT
// Messages to stderr by a thread of their own: whoever does not read them holds up nobody.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

namespace prism::daemon {

/// Writes lines to a descriptor, in order. What the queue cannot take is dropped and counted, and the count is the next
/// line that gets through. Any thread may call it; no call waits for the descriptor but finish(), for as long as it is
/// told.
class MessageThread {
 public:
  static constexpr std::size_t kLines = 1024;

  /// The descriptor is the caller's and outlives the process's last message.
  explicit MessageThread(int descriptor);
  /// Does not wait: what finish() left unwritten is lost.
  ~MessageThread();
  MessageThread(const MessageThread&) = delete;
  MessageThread& operator=(const MessageThread&) = delete;

  /// `line` with its line end.
  void put(std::string line);
  /// Until everything is written, `patience` at most. False: something is not.
  bool finish(std::chrono::milliseconds patience);

  std::uint64_t lost() const;

 private:
  // The thread may hang in write(2) for ever: what it uses lives as long as it does.
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

}  // namespace prism::daemon
