// SPDX-License-Identifier: MIT
#include "tools/prismweb/send_queue.hpp"

namespace prism::prismweb {

void SendQueue::put(const Text& text, bool is_answer) {
  waiting_.push_back({text, is_answer ? text->size() : 0});
  bytes_ += text->size();
  answer_bytes_ += waiting_.back().answer_bytes;
  memory_->bytes += waiting_.back().answer_bytes;
}

bool SendQueue::answer(const Text& text) {
  // Checks the queue without the response: an hour of history is long.
  if (bytes_ > kMaxBytes || (memory_->bytes > kMaxAllBytes && bytes_ > kGuaranteedBytes)) return false;
  put(text, true);
  return true;
}

void SendQueue::batch(const std::string& instance, const Text& text, std::uint64_t rows) {
  losing_ = losing_ || (bytes_ > 0 && bytes_ + text->size() > kMaxBatchBytes);
  if (!losing_) return put(text, false);
  lost_[instance].rows += rows;
  lost_[instance].rows_total += rows;
}

Text SendQueue::take() {
  const auto [text, answer_bytes] = waiting_.front();
  waiting_.pop_front();
  bytes_ -= text->size();
  answer_bytes_ -= answer_bytes;
  memory_->bytes -= answer_bytes;
  if (waiting_.empty() && losing_) queue_lost();
  return text;
}

void SendQueue::queue_lost() {
  losing_ = false;
  for (auto& [instance, lost] : lost_) {
    if (lost.rows == 0) continue;
    put(std::make_shared<const std::string>(lost_text_(instance, lost.rows, lost.rows_total)), false);
    lost.rows = 0;
  }
}

}  // namespace prism::prismweb
