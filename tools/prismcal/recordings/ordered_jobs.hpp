// SPDX-License-Identifier: MIT
// Jobs on all cores, whose results are taken in the order in which the jobs were started.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <future>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace prism::recordings {

/// One thread starts the jobs and takes their results. The destructor waits for the jobs that run, and drops the
/// others.
template <class Value>
class OrderedJobs {
 public:
  OrderedJobs() {
    for (std::size_t i = std::max(1u, std::thread::hardware_concurrency()); i > 0; --i)
      workers_.emplace_back([this](const std::stop_token& stop) { work(stop); });
  }
  bool empty() const { return started_.empty(); }
  /// Enough jobs are started to keep all cores busy: take() first.
  bool full() const { return started_.size() > workers_.size(); }
  template <class Job>
  void start(Job&& job) {
    std::packaged_task<Value()> task(std::forward<Job>(job));
    started_.push_back(task.get_future());
    {
      const std::lock_guard lock(mutex_);
      waiting_.push_back(std::move(task));
    }
    wake_.notify_one();
  }
  /// Waits for the oldest job.
  Value take() {
    std::future<Value> oldest = std::move(started_.front());
    started_.pop_front();
    return oldest.get();
  }

 private:
  void work(const std::stop_token& stop) {
    for (;;) {
      std::packaged_task<Value()> task;
      {
        std::unique_lock lock(mutex_);
        if (!wake_.wait(lock, stop, [this] { return !waiting_.empty(); }) || stop.stop_requested()) return;
        task = std::move(waiting_.front());
        waiting_.pop_front();
      }
      task();
    }
  }

  std::deque<std::future<Value>> started_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<std::packaged_task<Value()>> waiting_;
  std::vector<std::jthread> workers_;  ///< last: they end before the members that they use
};

}  // namespace prism::recordings
