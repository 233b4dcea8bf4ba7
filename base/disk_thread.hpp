// SPDX-License-Identifier: MIT
// The one thread that may wait for the disk, behind a bounded queue: the live path never does.
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

/// Runs the tasks posted, in order. The destructor runs what is queued and joins. A task that throws ends nothing but
/// itself.
class DiskThread {
 public:
  using Task = std::function<void()>;
  using Failed = std::function<void(const std::string& why)>;

  /// `max_bytes`: how much posted data may wait. `failed` hears, on the disk thread, why a task threw that nobody else
  /// answers for.
  DiskThread(std::size_t max_bytes, Failed failed);
  ~DiskThread();
  DiskThread(const DiskThread&) = delete;
  DiskThread& operator=(const DiskThread&) = delete;

  /// Queues a task that holds `bytes` of data. False, and the task is not taken, where the queue is full: the caller
  /// counts what it lost. A task with bytes = 0 (sync, close) is always taken. Where the task throws, `failed` is
  /// called in place of the constructor's, to count what was lost with it and to tell.
  bool post(std::size_t bytes, Task task, Failed failed = nullptr);

  /// Waits until everything posted so far has run.
  void drain();
  /// The same, `patience` at most. False: something has not.
  bool drain(std::chrono::milliseconds patience);
  /// How long the task that runs has run; zero where none does.
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
