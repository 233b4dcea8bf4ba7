// SPDX-License-Identifier: MIT
#include "tools/prismweb/send_queue.hpp"

namespace prism::prismweb {

void SendQueue::put(const Text& text) {
  texts_.push_back(text);
  bytes_ += text->size();
}

bool SendQueue::answer(const Text& text) {
  if (bytes_ > kMostBytes) return false;  // what waits counts, not the answer: an hour of history is long
  put(text);
  return true;
}

void SendQueue::batch(const std::string& instance, const Text& text, std::uint64_t rows) {
  losing_ = losing_ || (bytes_ > 0 && bytes_ + text->size() > kMostBatchBytes);
  if (!losing_) return put(text);
  lost_[instance].rows += rows;
  lost_[instance].rows_total += rows;
}

Text SendQueue::take() {
  Text text = texts_.front();
  texts_.pop_front();
  bytes_ -= text->size();
  if (texts_.empty() && losing_) tell_lost();
  return text;
}

void SendQueue::tell_lost() {
  losing_ = false;
  for (auto& [instance, lost] : lost_) {
    if (lost.rows == 0) continue;
    put(std::make_shared<const std::string>(lost_text_(instance, lost.rows, lost.rows_total)));
    lost.rows = 0;
  }
}

}  // namespace prism::prismweb
