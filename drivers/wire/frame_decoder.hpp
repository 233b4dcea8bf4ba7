// SPDX-License-Identifier: MIT
// Finds frames in a stream of bytes, however it is cut and damaged, and reads them as the description says.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/wire/frame_description.hpp"
#include "drivers/wire/reading.hpp"

namespace prism {

/// What happened on the line since the decoder was made; reset() keeps them.
struct DecoderCounters {
  std::uint64_t bytes = 0;
  std::uint64_t frames = 0;         ///< good ones, of every kind
  std::uint64_t bad_check = 0;      ///< candidates with the right sync and length whose check failed
  std::uint64_t bad_length = 0;     ///< candidates whose length field was out of bounds, or that never ended
  std::uint64_t bad_body = 0;       ///< candidates against a body rule
  std::uint64_t skipped_bytes = 0;  ///< bytes that belong to no good frame
  std::uint64_t resyncs = 0;        ///< times a run of good frames was broken: one damaged place, one count
  std::uint64_t timeouts = 0;       ///< candidates given up because the line fell silent
  std::uint64_t unconfirmed = 0;    ///< good-looking frames under a weak check that no second one confirmed
  std::uint64_t out_of_range = 0;   ///< field values outside the range their description gives
};

/// A frame is looked for at every offset: after a candidate failed, the search goes on at its second byte, so a good
/// frame behind or inside a bad one is never lost. The readings (offset, values) depend on the bytes only, not on how
/// they were cut into chunks; their times depend on the chunks' arrival times only, not on timers.
///
/// Where the checks of a kind have less than 16 bits together, the first frame after a start (or after a long stretch
/// without any) is held back until the next one, directly behind it, confirms it.
///
/// A candidate whose end is missing holds up what is behind it. It is given up when the line has been silent for twice
/// the wire time of the longest frame, at least 25 ms: longer than the 16 ms in which USB adapters cut frames.
///
/// Memory: at most one frame and one slice of input (16 KiB); no allocation per frame.
class FrameDecoder {
 public:
  explicit FrameDecoder(FrameDescriptionPtr description);

  /// Takes the next bytes of the stream; `arrival_ns` is when the last of them had arrived and never decreases.
  /// Appends to `out` and leaves what it holds alone.
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns, std::vector<Reading>& out);

  /// For a live line's timer: nothing has arrived until `now_ns` since the last feed. Only makes readings come sooner;
  /// the next feed would find the same ones.
  void expire(std::int64_t now_ns, std::vector<Reading>& out);

  /// The stream has ended: reads what can still be read.
  void finish(std::vector<Reading>& out);

  /// A new session of the device: forgets held bytes and slow channels; offsets and counters go on.
  void reset();

  /// Silence after which a waiting candidate is given up, ns.
  std::int64_t timeout_ns() const { return timeout_ns_; }
  /// True while bytes of an unfinished candidate are held: expire() can do something.
  bool waiting() const { return !buffer_.empty(); }
  const DecoderCounters& counters() const { return counters_; }
  const FrameDescription& description() const { return *description_; }

 private:
  FrameDescriptionPtr description_;
  std::int64_t timeout_ns_ = 0;
  std::vector<std::uint8_t> buffer_;
  DecoderCounters counters_;
};

}  // namespace prism
