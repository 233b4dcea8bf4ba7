// SPDX-License-Identifier: MIT
// Jobs on all cores, whose results are taken in the order in which the jobs were started.
#pragma once

#include <cstddef>
#include <deque>
#include <future>
#include <thread>
#include <utility>

namespace prism::recordings {

/// One thread starts the jobs and takes their results. The destructor waits for the jobs that run.
template <class Value>
class OrderedJobs {
 public:
  bool empty() const { return running_.empty(); }
  /// As many jobs run as keep all cores busy: take() first.
  bool full() const { return running_.size() > std::thread::hardware_concurrency(); }
  template <class Job>
  void start(Job&& job) {
    running_.push_back(std::async(std::launch::async, std::forward<Job>(job)));
  }
  /// Waits for the oldest job.
  Value take() {
    std::future<Value> oldest = std::move(running_.front());
    running_.pop_front();
    return oldest.get();
  }

 private:
  std::deque<std::future<Value>> running_;
};

}  // namespace prism::recordings
