// SPDX-License-Identifier: MIT
#include "tools/prismweb/turn_queue.hpp"

#include <utility>

namespace prism::prismweb {

void TurnQueue::run(Task task) {
  waiting_.push_back(std::move(task));
  start_next();
}

void TurnQueue::start_next() {
  if (starting_) return;
  starting_ = true;
  while (running_ < kMaxRunning && !waiting_.empty()) {
    const Task task = std::move(waiting_.front());
    waiting_.pop_front();
    ++running_;
    task([self = shared_from_this()] {
      --self->running_;
      self->start_next();
    });
  }
  starting_ = false;
}

}  // namespace prism::prismweb
