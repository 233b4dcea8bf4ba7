// SPDX-License-Identifier: MIT
// Frames between delimiters (byte stuffing), unstuffed, that the decoder has not decided yet.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/wire/description/stuffing.hpp"

namespace prism::wire {

/// The bytes of the frames are one after the other in a buffer of the decoder, so that it can search there. A lost
/// frame has one byte in it, which belongs to no frame.
class EnclosedFrames {
 public:
  struct Frame {
    std::uint64_t begin = 0,
                  end = 0;         ///< in the stream: from a delimiter before it, if free, to after the one at its end
    std::size_t at = 0, size = 0;  ///< of its bytes in the buffer
    bool opened = false;           ///< a delimiter preceded it; else it may be the rest of a frame
    bool lost = false;             ///< damaged, or too long
    bool continued = false;        ///< further bytes of a lost frame
  };

  /// Not for Stuffing::kNone. A frame has at most `max_bytes` bytes without stuffing.
  EnclosedFrames(Stuffing stuffing, std::size_t max_bytes) : unstuffer_(stuffing, max_bytes) {}

  /// Unstuffs the next bytes of the stream; appends the bytes of the frames that they complete to `buffer`.
  void feed(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& buffer);

  /// The frame whose bytes begin at `at` in the buffer.
  const Frame& frame_at(std::size_t at) const;
  /// Removes the frames whose bytes are the first `bytes` of the buffer; the caller removes the bytes.
  void drop(std::size_t bytes);
  /// Offset in the stream of the first byte that is not decided, or its end.
  std::uint64_t undecided_from() const;
  /// Forgets the frame that is not complete. Returns its bytes in the stream.
  std::uint64_t end_stream();

 private:
  void add(Unstuffer::Step step, std::vector<std::uint8_t>& buffer);

  Unstuffer unstuffer_;
  std::vector<Frame> frames_;
  std::uint64_t position_ = 0;  ///< in the stream, after the last byte
  std::uint64_t begin_ = 0;     ///< of the current frame, as Frame::begin
  bool opened_ = false;
};

}  // namespace prism::wire
