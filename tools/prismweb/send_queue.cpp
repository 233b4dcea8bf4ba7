// SPDX-License-Identifier: MIT
#include "tools/prismweb/send_queue.hpp"

namespace prism::prismweb {

SendQueue::SendQueue(std::shared_ptr<UnsentMemory> memory, std::function<void()> close, LostText lost_text)
    : memory_(std::move(memory), [this] { discard(); }), close_(std::move(close)), lost_text_(std::move(lost_text)) {}

void SendQueue::put(const Text& text, bool is_answer) {
  if (is_closed_) return;
  const std::size_t bytes = text->size() + kTextBytes;
  waiting_.push_back({text, is_answer});
  bytes_ += bytes;
  if (is_answer) answer_bytes_ += bytes;
  memory_.add(bytes);
}

bool SendQueue::answer(const Text& text) {
  // Checks the queue without the response: an hour of history is long.
  if (bytes_ > kMaxBytes) return false;
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
  const Waiting next = std::move(waiting_.front());
  waiting_.pop_front();
  sending_bytes_ = next.text->size() + kTextBytes;
  sending_answer_bytes_ = next.is_answer ? sending_bytes_ : 0;
  return next.text;
}

void SendQueue::sent() {
  if (is_closed_) return;
  bytes_ -= sending_bytes_;
  answer_bytes_ -= std::exchange(sending_answer_bytes_, 0);
  memory_.remove(std::exchange(sending_bytes_, 0));
  if (waiting_.empty() && losing_) queue_lost();
}

void SendQueue::queue_lost() {
  losing_ = false;
  for (auto& [instance, lost] : lost_) {
    if (lost.rows == 0) continue;
    put(std::make_shared<const std::string>(lost_text_(instance, lost.rows, lost.rows_total)), false);
    lost.rows = 0;
  }
}

void SendQueue::discard() {
  is_closed_ = true;
  waiting_.clear();
  bytes_ = answer_bytes_ = sending_bytes_ = sending_answer_bytes_ = 0;
  close_();
}

}  // namespace prism::prismweb
