// SPDX-License-Identifier: MIT
// Explains bytes by descriptions: every value of a frame, test vectors, checks that never fit, and which description an
// unknown line has.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/wire/decode/frame_decoder.hpp"

namespace prism::wire {

struct InspectedFrame {
  struct Value {
    std::string field;
    std::string unit;
    double value = 0;  ///< kUnknown: in the frame, but out of range or not a number
  };
  std::int32_t kind = -1;
  std::string kind_name;
  std::uint32_t length = 0;
  std::vector<Value> values;  ///< of the fields in the frame, in the description's order
};

/// The frame that starts with the first byte; nullopt if no message type matches or the frame is incomplete.
std::optional<InspectedFrame> inspect_frame(const FrameDescription& description, std::span<const std::uint8_t> bytes);

/// Decodes every test vector of the description. Errors: the first vector with a different result.
Result<void> run_test_vectors(const FrameDescription& description);

/// "frames trplg, 3 test vectors hold"; without vectors, that nothing is proved.
std::string proof_text(const FrameDescription& description);

// The usual variants of a check that never fits: range, byte order, and parameters of a CRC.

/// One line about the places in `bytes` at which sync, length and body of a message type fit, but a check does not:
/// "2000 candidates of data: the check is 4D 22, computed 91 C3 over bytes 0 to 17; with "from": 2 it fits". Empty if
/// there are fewer than ten, or a check fits. Uses at most 64 candidates.
std::string explain_checks(const FrameDescription& description, std::span<const std::uint8_t> bytes);

// The pure half of `prismd --sniff`.

struct SniffScore {
  FrameDescriptionPtr description;
  std::uint64_t frames = 0;        ///< good frames of all message types
  std::uint64_t rates = 0;         ///< of them, frames with a rate
  std::uint64_t bytes = 0;         ///< received bytes
  std::uint64_t framed_bytes = 0;  ///< of them, bytes in good frames or their trailers
  std::uint64_t single = 0;        ///< frames that fit, but are not accepted, because no second one confirmed them
  double rate_hz = 0;              ///< frames per second by arrival times; 0 if the times are unusable
  bool fits = false;
  bool too_few = false;  ///< everything matches except the number of frames

  double share() const { return bytes == 0 ? 0 : static_cast<double>(framed_bytes) / static_cast<double>(bytes); }
  /// Too many single frames to be chance: bytes of other messages are between them.
  bool has_gaps() const {
    return !fits && 5 * single * static_cast<std::uint64_t>(description->max_frame_bytes) >= bytes && single >= 10;
  }
};

/// Feeds the same bytes to a decoder of each description. Use one Sniffer per speed and parity, because other settings
/// give other bytes.
///
/// A description fits if at least three frames were received, some with a rate, and they contain at least half of the
/// bytes; random bytes never do, because the decoder requires confirmation of weak frames. Several can fit (devices
/// share frames); the data cannot distinguish them.
class Sniffer {
 public:
  explicit Sniffer(const std::vector<FrameDescriptionPtr>& descriptions);

  /// As FrameDecoder::feed.
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);

  /// Best first: those that fit, then by share of bytes in frames, then by frames. Bytes of an incomplete frame do not
  /// count.
  std::vector<SniffScore> ranking() const;

 private:
  std::vector<FrameDecoder> decoders_;
  std::vector<std::uint64_t> rates_;  ///< of each decoder
  std::vector<DecodedMessage> readings_;
  std::uint64_t bytes_ = 0;
  std::int64_t first_ns_ = 0;
  std::int64_t last_ns_ = 0;
};

/// Why a weak check accepts no frame of a stream that has many.
std::string single_frames_text(std::uint64_t count);

/// One human-readable line: "kvh1750      fits   1204 frames, 99.8 % of 43441 bytes, 1000 Hz"; if it does not fit,
/// followed by the reason.
std::string sniff_line(const SniffScore& score);

}  // namespace prism::wire
