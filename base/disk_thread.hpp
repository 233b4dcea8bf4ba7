// SPDX-License-Identifier: MIT
// The only thread that may wait for the disk; tasks pass through a bounded queue.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace prism {

/// Runs the posted tasks in order. The destructor runs the queued tasks and joins. A task that throws does not affect
/// other tasks.
class DiskThread {
 public:
  using Task = std::function<void()>;
  using Failed = std::function<void(const std::string& why)>;

  /// `max_bytes`: limit of the queued data. `failed` is called on the disk thread if a task without a callback of its
  /// own throws.
  DiskThread(std::size_t max_bytes, Failed failed);
  ~DiskThread();
  DiskThread(const DiskThread&) = delete;
  DiskThread& operator=(const DiskThread&) = delete;

  /// Queues a task that contains `bytes` of data. Returns false if the queue is full: the caller counts the loss.
  /// Always accepts a task with bytes = 0 (sync, close). If the task throws, calls this `failed` instead of the
  /// constructor's.
  bool post(std::size_t bytes, Task task, Failed failed = nullptr);

  /// Waits until everything posted so far has run, at most `timeout`. Returns false if tasks are left.
  bool drain(std::chrono::milliseconds timeout = std::chrono::hours(1));
  /// Run time so far of the current task; zero if idle.
  std::chrono::steady_clock::duration busy_for() const;

 private:
  struct Entry {
    std::size_t bytes;
    Task task;
    Failed failed;
  };
  void run();
  void run(Entry& entry) const noexcept;

  const std::size_t max_bytes_;
  const Failed failed_;
  mutable std::mutex mutex_;
  std::condition_variable work_, idle_;
  std::deque<Entry> queue_;
  std::size_t queued_bytes_ = 0;
  bool busy_ = false, stop_ = false;
  std::chrono::steady_clock::time_point busy_since_;
  std::thread thread_;
};

}  // namespace prism
