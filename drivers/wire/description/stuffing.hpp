// SPDX-License-Identifier: MIT
// Byte stuffing below the frames: a delimiter ends each frame, and the bytes in it are encoded so that it occurs
// nowhere else.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace prism::wire {

enum class Stuffing : std::uint8_t {
  kNone,
  kSlip,  ///< RFC 1055: delimiter C0; DB DC is C0, DB DD is DB
  kCobs,  ///< Cheshire and Baker 1999: delimiter 00; a code byte gives the distance to the next zero
  kHdlc,  ///< RFC 1662, section 4.2: delimiter 7E; 7D x is x XOR 20
};

/// Bytes on the line of a frame of `bytes` bytes without escapes, with the delimiters that stuff() writes.
std::uint32_t stuffed_size(Stuffing stuffing, std::uint32_t bytes);

/// Appends the frame as sent on the line. SLIP and HDLC have a delimiter at both ends, COBS one at the end; kNone: the
/// frame itself.
void stuff(Stuffing stuffing, std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& out);

/// Decodes a stream of stuffed frames byte by byte. Memory: one frame.
class Unstuffer {
 public:
  enum class Step {
    kMore,   ///< inside a frame
    kEmpty,  ///< a delimiter directly after another one, or at the start
    kFrame,  ///< the delimiter that ends a frame: see frame()
    kBad,    ///< a wrong escape, an early delimiter or too many bytes: the frame is lost
    kLost,   ///< after kBad, up to the next delimiter inclusive
  };

  /// Not for kNone. A frame has at most `max_bytes` bytes.
  Unstuffer(Stuffing stuffing, std::size_t max_bytes);

  Step push(std::uint8_t byte);
  /// The last complete frame; valid until the next push().
  const std::vector<std::uint8_t>& frame() const { return frame_; }
  /// True between a frame's first byte and its delimiter.
  bool inside() const { return started_; }
  void reset();

 private:
  Step end_frame();
  bool take(std::uint8_t byte);
  bool take_escaped(std::uint8_t byte);
  bool take_cobs(std::uint8_t byte);
  bool append(std::uint8_t byte);

  Stuffing stuffing_;
  std::size_t max_bytes_;
  std::vector<std::uint8_t> frame_;
  bool started_ = false;  ///< a byte of the frame was received
  bool lost_ = false;
  bool escaped_ = false;   ///< kSlip, kHdlc: the previous byte was the escape
  bool zero_due_ = false;  ///< kCobs: a zero follows the current block unless the frame ends there
  unsigned left_ = 0;      ///< kCobs: bytes of the current block that are still missing
};

}  // namespace prism::wire
