// SPDX-License-Identifier: MIT
#include "tools/prismweb/unsent_memory.hpp"

#include <malloc.h>

#include <algorithm>
#include <utility>

namespace prism::prismweb {
namespace {

constexpr std::size_t kMinTrimBytes = 1 << 20;

}  // namespace

UnsentMemory::Part::Part(std::shared_ptr<UnsentMemory> all, std::function<void()> close)
    : all_(std::move(all)), close_(std::move(close)) {
  all_->parts_.insert(this);
}

UnsentMemory::Part::~Part() {
  remove(bytes_);
  all_->parts_.erase(this);
}

void UnsentMemory::Part::add(std::size_t bytes) {
  if (is_closed_) return;
  bytes_ += bytes;
  all_->bytes_ += bytes;
  all_->peak_bytes_ = std::max(all_->peak_bytes_, all_->bytes_);
  while (all_->bytes_ > kMaxBytes) all_->close_largest();
}

void UnsentMemory::Part::remove(std::size_t bytes) {
  if (is_closed_) return;
  bytes_ -= bytes;
  all_->bytes_ -= bytes;
}

void UnsentMemory::close_largest() {
  const auto less = [](const Part* a, const Part* b) { return a->bytes_ < b->bytes_; };
  Part& largest = **std::max_element(parts_.begin(), parts_.end(), less);
  bytes_ -= std::exchange(largest.bytes_, 0);
  largest.is_closed_ = true;
  largest.close_();
}

void UnsentMemory::trim() {
  if (peak_bytes_ < bytes_ + kMinTrimBytes) return;
  peak_bytes_ = bytes_;
  ::malloc_trim(0);
}

}  // namespace prism::prismweb
