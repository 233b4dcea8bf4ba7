// SPDX-License-Identifier: MIT
// Limits how many tasks run at a time.
#pragma once

#include <deque>
#include <functional>
#include <memory>

namespace prism::prismweb {

/// Runs tasks in order, at most kMaxRunning at a time: the intermediate results of a request for past data are larger
/// than its response. Not thread-safe.
class TurnQueue : public std::enable_shared_from_this<TurnQueue> {
 public:
  static constexpr int kMaxRunning = 2;
  using End = std::function<void()>;
  using Task = std::function<void(const End& end)>;

  /// Calls `task` now or later. The task must call `end` exactly once.
  void run(Task task);

 private:
  void start_next();

  std::deque<Task> waiting_;
  int running_ = 0;
  bool starting_ = false;  ///< start_next() runs: a task that ends at once does not recurse
};

}  // namespace prism::prismweb
