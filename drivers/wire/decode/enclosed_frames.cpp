// SPDX-License-Identifier: MIT
#include "drivers/wire/decode/enclosed_frames.hpp"

#include <algorithm>

namespace prism::wire {

void EnclosedFrames::feed(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& buffer) {
  using Step = Unstuffer::Step;
  for (const std::uint8_t byte : bytes) {
    const Step step = unstuffer_.push(byte);
    ++position_;
    if (step == Step::kMore) continue;
    if (step == Step::kEmpty)
      begin_ = position_ - 1;
    else
      add(step, buffer);
    opened_ = true;
  }
}

void EnclosedFrames::add(Unstuffer::Step step, std::vector<std::uint8_t>& buffer) {
  const bool lost = step != Unstuffer::Step::kFrame;
  const bool continued = step == Unstuffer::Step::kLost;
  if (continued && !frames_.empty()) {
    frames_.back().end = position_;  // of the lost frame
  } else {
    const std::size_t at = buffer.size();
    if (lost)
      buffer.push_back(0);
    else
      buffer.insert(buffer.end(), unstuffer_.frame().begin(), unstuffer_.frame().end());
    frames_.push_back({begin_, position_, at, buffer.size() - at, opened_, lost, continued});
  }
  begin_ = position_;
}

const EnclosedFrames::Frame& EnclosedFrames::frame_at(std::size_t at) const {
  return *std::lower_bound(frames_.begin(), frames_.end(), at,
                           [](const Frame& frame, std::size_t offset) { return frame.at < offset; });
}

void EnclosedFrames::drop(std::size_t bytes) {
  const auto kept = std::find_if(frames_.begin(), frames_.end(), [&](const Frame& frame) { return frame.at >= bytes; });
  frames_.erase(frames_.begin(), kept);
  for (Frame& frame : frames_) frame.at -= bytes;
}

std::uint64_t EnclosedFrames::undecided_from() const {
  if (!frames_.empty()) return frames_.front().begin;
  return unstuffer_.inside() ? begin_ : position_;
}

std::uint64_t EnclosedFrames::end_stream() {
  const std::uint64_t bytes = unstuffer_.inside() ? position_ - begin_ : 0;
  unstuffer_.reset();
  frames_.clear();
  begin_ = position_;
  opened_ = false;
  return bytes;
}

}  // namespace prism::wire
