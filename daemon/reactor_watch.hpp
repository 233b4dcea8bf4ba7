// SPDX-License-Identifier: MIT
// Calls a thread out of a blocking read(2) when Asio has something to do.
#pragma once

#include <signal.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace prism::daemon {

/// An eventfd(2) that does not block and is not inherited. Throws boost::system::system_error where there is none to
/// have.
int make_eventfd();

/// A thread that waits for a descriptor (Asio's epoll set) in the place of one that reads from another. When the
/// descriptor is readable it rings, and interrupts the reader with SIGURG until that answers: a signal that comes just
/// before the read begins would be missed, so that one is not enough.
///
/// SIGURG, since it is ignored by default: where one comes late, nothing happens. Reads see EINTR.
class ReactorWatch {
 public:
  /// The calling thread is the one that is interrupted.
  explicit ReactorWatch(int descriptor);
  ~ReactorWatch();
  ReactorWatch(const ReactorWatch&) = delete;
  ReactorWatch& operator=(const ReactorWatch&) = delete;

  /// The descriptor was readable, and answer() was not called since.
  bool rung() const { return rung_.load(std::memory_order_acquire); }
  /// After the descriptor was served: watches it anew.
  void answer();
  /// Only in between the reader is interrupted, so that no other system call is.
  void begin_read() { reading_.store(true, std::memory_order_relaxed); }
  void end_read() { reading_.store(false, std::memory_order_relaxed); }

 private:
  void watch();
  void ring();

  const int descriptor_;
  const int quit_;  ///< eventfd
  const pthread_t reader_;
  struct sigaction before_ {};
  std::atomic<bool> rung_ = false, reading_ = false;
  std::mutex mutex_;
  std::condition_variable answered_;
  bool quitting_ = false;
  std::thread thread_;
};

}  // namespace prism::daemon
