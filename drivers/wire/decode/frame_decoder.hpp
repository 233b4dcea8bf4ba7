// SPDX-License-Identifier: MIT
// Finds frames in a stream of bytes, however it is cut and damaged, and reads them as the description says.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/wire/decode/frame_match.hpp"
#include "drivers/wire/decode/reading_maker.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::wire {

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
/// A candidate whose end is missing holds up what is behind it. When the line has been silent for twice the wire time
/// of the longest frame, at least 5 ms, good frames behind the candidate are looked for; where one stands, the
/// candidate is given up. Where none stands it goes on waiting, so that a frame which a USB adapter (16 ms) or a
/// stalled machine cut in two is never lost.
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
  bool waiting() const { return !held_.empty(); }
  /// When the chunk had arrived in which the frame ended.
  std::int64_t chunk_arrival_ns(const Reading& reading) const;
  /// Of the oldest chunk that a frame which is still to be found may end in; nothing is held: the next one's.
  std::optional<std::int64_t> held_since_ns() const {
    return waiting() && !chunk_ends_.empty() ? std::optional(chunk_ends_.front().arrival_ns) : std::nullopt;
  }
  const DecoderCounters& counters() const { return counters_; }
  const FrameDescription& description() const { return *description_; }
  const FrameDescriptionPtr& description_ptr() const { return description_; }
  /// Bytes that are not decided yet.
  std::size_t held_bytes() const { return held_.size(); }

 private:
  /// The bytes up to stream offset `end` had arrived at `arrival_ns`.
  struct ChunkEnd {
    std::uint64_t end = 0;
    std::int64_t arrival_ns = 0;
  };
  enum class Mode { kMore, kSilent, kEnd };  ///< what a missing end means: wait; try others meanwhile; give up
  struct Candidate {
    Match match = Match::kNoSync;
    std::int32_t kind = -1;
    std::uint32_t length = 0;
    std::uint32_t bad_length = 0, bad_body = 0, bad_check = 0, unconfirmed = 0;  ///< kinds that failed here, by cause
  };

  void scan(Mode mode, std::vector<Reading>& out);
  bool look_behind(std::vector<Reading>& out);
  Candidate look_at(std::size_t at, Mode mode);
  Candidate try_kinds(std::size_t at, Mode mode, FrameView& view);
  bool confirmed(std::size_t at, const Candidate& candidate, Mode mode, bool& need_more);
  bool counter_steps(const FrameView& before, std::int32_t kind_before, const FrameView& behind,
                     std::int32_t kind) const;
  void count(const Candidate& candidate);
  std::size_t next_possible(std::size_t at) const;
  bool skip_trailer(std::size_t at);
  void skip(std::size_t bytes);
  void accept(std::size_t at, const Candidate& candidate, std::vector<Reading>& out);
  void set_arrival(Reading& reading, std::uint64_t end) const;
  void drop_held(std::size_t bytes);

  FrameDescriptionPtr description_;
  ReadingMaker maker_;
  FrameView view_;
  DecoderCounters counters_;
  double byte_time_ns_ = 0;
  std::int64_t timeout_ns_ = 0;
  std::array<std::uint64_t, 256> kinds_by_first_byte_{};  ///< bit k: kind k may begin with this byte
  int only_first_byte_ = -1;                              ///< where every kind begins with the same one

  std::vector<std::uint8_t> held_;    ///< bytes not decided yet
  std::uint64_t held_offset_ = 0;     ///< of held_[0] in the stream
  int before_held_ = -1;              ///< the byte in front of held_[0]
  std::vector<ChunkEnd> chunk_ends_;  ///< of the chunks that reach into held_, oldest first
  std::int64_t last_arrival_ns_ = 0;

  bool locked_ = false;              ///< frames of weak kinds are believed at once
  bool in_run_ = false;              ///< the byte before was the end of a good frame
  std::uint64_t last_good_end_ = 0;  ///< in the stream
  std::int32_t last_kind_ = -1;
  std::size_t trailer_at_ = 0;          ///< bytes of last_kind_'s trailer seen behind the last frame
  std::uint64_t lost_after_bytes_ = 0;  ///< without a good frame, until the lock is gone
};

}  // namespace prism::wire
