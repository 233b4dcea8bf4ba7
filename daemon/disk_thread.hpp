// SPDX-License-Identifier: MIT
// The one thread that may wait for the disk, behind a bounded queue: the live path never does.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace prism::daemon {

/// Runs the tasks posted, in order. The destructor runs what is queued and joins.
class DiskThread {
 public:
  using Task = std::function<void()>;

  /// `max_bytes`: how much posted data may wait.
  explicit DiskThread(std::size_t max_bytes);
  ~DiskThread();
  DiskThread(const DiskThread&) = delete;
  DiskThread& operator=(const DiskThread&) = delete;

  /// Queues a task that holds `bytes` of data. False, and the task is not taken, where the queue is full: the caller
  /// counts what it lost. A task with bytes = 0 (sync, close) is always taken.
  bool post(std::size_t bytes, Task task);

  /// Waits until everything posted so far has run.
  void drain();

 private:
  void run();

  struct Entry {
    std::size_t bytes;
    Task task;
  };
  const std::size_t max_bytes_;
  std::mutex mutex_;
  std::condition_variable work_, idle_;
  std::deque<Entry> queue_;
  std::size_t queued_bytes_ = 0;
  bool busy_ = false, stop_ = false;
  std::thread thread_;
};

}  // namespace prism::daemon
