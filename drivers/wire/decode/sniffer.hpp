// SPDX-License-Identifier: MIT
// Which of many descriptions fits the bytes of an unknown line: the pure half of `prismd --sniff`.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/wire/decode/frame_decoder.hpp"

namespace prism::wire {

struct SniffScore {
  FrameDescriptionPtr description;
  std::uint64_t frames = 0;        ///< good ones, of every kind
  std::uint64_t rates = 0;         ///< of them with a rate of turn
  std::uint64_t bytes = 0;         ///< seen
  std::uint64_t framed_bytes = 0;  ///< of them within good frames (or their trailers)
  double rate_hz = 0;              ///< frames a second as they arrived; 0 where the times say nothing
  bool fits = false;
  bool too_few = false;  ///< all but the count of frames says that it fits

  double share() const { return bytes == 0 ? 0 : static_cast<double>(framed_bytes) / static_cast<double>(bytes); }
};

/// Feeds the same bytes to a decoder of each description. One Sniffer a speed and parity: bytes that were received with
/// other settings are other bytes.
///
/// A description fits when at least three frames were seen, with a rate of turn in some, and at least half of the bytes
/// stand in them; random bytes never come near that, because the decoder asks weak frames for confirmation. Several may
/// fit (devices share frames); the line cannot tell more.
class Sniffer {
 public:
  explicit Sniffer(const std::vector<FrameDescriptionPtr>& descriptions);

  /// As FrameDecoder::feed.
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);

  /// Best first: those that fit, then by the share of explained bytes, then by frames. Bytes of a frame that is not
  /// whole yet count as not explained.
  std::vector<SniffScore> ranking() const;

 private:
  std::vector<FrameDecoder> decoders_;
  std::vector<std::uint64_t> rates_;  ///< of each decoder
  std::vector<Reading> readings_;
  std::uint64_t bytes_ = 0;
  std::int64_t first_ns_ = 0;
  std::int64_t last_ns_ = 0;
};

/// One line for people: "kvh1750      fits   1204 frames, 99.8 % of 43441 bytes, 1000 Hz"; where it does not fit, what
/// is missing behind it.
std::string sniff_line(const SniffScore& score);

}  // namespace prism::wire
