// SPDX-License-Identifier: MIT
#include "drivers/wire/description/stuffing.hpp"

#include <algorithm>

namespace prism::wire {
namespace {

constexpr std::uint8_t kSlipEnd = 0xC0, kSlipEscape = 0xDB, kSlipEscapedEnd = 0xDC, kSlipEscapedEscape = 0xDD;
constexpr std::uint8_t kHdlcFlag = 0x7E, kHdlcEscape = 0x7D, kHdlcFlip = 0x20;
constexpr std::size_t kCobsBlock = 254;  // bytes after a code byte, at most

std::uint8_t delimiter_of(Stuffing stuffing) {
  return stuffing == Stuffing::kSlip ? kSlipEnd : stuffing == Stuffing::kHdlc ? kHdlcFlag : std::uint8_t{0};
}

void stuff_cobs(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& out) {
  for (;;) {
    const auto zero = std::find(frame.begin(), frame.end(), std::uint8_t{0});
    const std::size_t size = std::min(static_cast<std::size_t>(zero - frame.begin()), kCobsBlock);
    out.push_back(static_cast<std::uint8_t>(size + 1));
    out.insert(out.end(), frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size));
    if (size == frame.size()) break;
    frame = frame.subspan(size == kCobsBlock ? size : size + 1);
  }
  out.push_back(0);
}

void stuff_byte(Stuffing stuffing, std::uint8_t byte, std::vector<std::uint8_t>& out) {
  const bool slip = stuffing == Stuffing::kSlip;
  const std::uint8_t escape = slip ? kSlipEscape : kHdlcEscape;
  if (byte != delimiter_of(stuffing) && byte != escape) return out.push_back(byte);
  out.push_back(escape);
  if (slip)
    out.push_back(byte == kSlipEnd ? kSlipEscapedEnd : kSlipEscapedEscape);
  else
    out.push_back(static_cast<std::uint8_t>(byte ^ kHdlcFlip));
}

}  // namespace

std::uint32_t stuffed_size(Stuffing stuffing, std::uint32_t bytes) {
  if (stuffing == Stuffing::kNone) return bytes;
  const std::uint32_t codes = stuffing == Stuffing::kCobs ? bytes / static_cast<std::uint32_t>(kCobsBlock) : 0;
  return bytes + codes + 2;
}

void stuff(Stuffing stuffing, std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& out) {
  if (stuffing == Stuffing::kCobs) return stuff_cobs(frame, out);
  if (stuffing == Stuffing::kNone) {
    out.insert(out.end(), frame.begin(), frame.end());
    return;
  }
  out.push_back(delimiter_of(stuffing));
  for (const std::uint8_t byte : frame) stuff_byte(stuffing, byte, out);
  out.push_back(delimiter_of(stuffing));
}

Unstuffer::Unstuffer(Stuffing stuffing, std::size_t max_bytes) : stuffing_(stuffing), max_bytes_(max_bytes) {
  frame_.reserve(max_bytes);
}

void Unstuffer::reset() {
  started_ = lost_ = escaped_ = zero_due_ = false;
  left_ = 0;
}

Unstuffer::Step Unstuffer::push(std::uint8_t byte) {
  if (byte == delimiter_of(stuffing_)) return end_frame();
  if (lost_) return Step::kLost;
  if (!started_) frame_.clear();
  started_ = true;
  if (take(byte)) return Step::kMore;
  lost_ = true;
  return Step::kBad;
}

Unstuffer::Step Unstuffer::end_frame() {
  const Step step = lost_                   ? Step::kLost
                    : !started_             ? Step::kEmpty
                    : escaped_ || left_ > 0 ? Step::kBad
                    : frame_.empty()        ? Step::kBad
                                            : Step::kFrame;
  reset();
  return step;
}

bool Unstuffer::take(std::uint8_t byte) { return stuffing_ == Stuffing::kCobs ? take_cobs(byte) : take_escaped(byte); }

bool Unstuffer::take_escaped(std::uint8_t byte) {
  const bool slip = stuffing_ == Stuffing::kSlip;
  if (!escaped_) {
    escaped_ = byte == (slip ? kSlipEscape : kHdlcEscape);
    return escaped_ || append(byte);
  }
  escaped_ = false;
  if (!slip) return append(static_cast<std::uint8_t>(byte ^ kHdlcFlip));
  if (byte != kSlipEscapedEnd && byte != kSlipEscapedEscape) return false;
  return append(byte == kSlipEscapedEnd ? kSlipEnd : kSlipEscape);
}

bool Unstuffer::take_cobs(std::uint8_t byte) {
  if (left_ > 0) {
    --left_;
    return append(byte);
  }
  if (zero_due_ && !append(0)) return false;
  left_ = byte - 1u;
  zero_due_ = left_ < kCobsBlock;
  return true;
}

bool Unstuffer::append(std::uint8_t byte) {
  if (frame_.size() >= max_bytes_) return false;
  frame_.push_back(byte);
  return true;
}

}  // namespace prism::wire
