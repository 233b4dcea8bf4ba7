// SPDX-License-Identifier: MIT
// Finds frames in a stream of bytes, independent of chunks and damage, and decodes them by the description.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/wire/decode/message_decoder.hpp"
#include "drivers/wire/description/frame_description.hpp"
#include "drivers/wire/description/frame_view.hpp"
#include "drivers/wire/description/message_type.hpp"

namespace prism::wire {

// Tests if a frame of a message type starts here: sync, length, body and checks, in this order.

enum class Match {
  kYes,
  kNeedMore,  ///< matches so far, but the frame continues after the available bytes
  kNoSync,
  kBadLength,  ///< invalid length field, or no terminator within the maximum length
  kBadBody,    ///< violates a body rule, or has broken items or columns
  kBadCheck,
  kRefused,  ///< intact, but a refuse rule applies
};

struct MatchResult {
  Match match = Match::kNoSync;
  std::uint32_t length = 0;  ///< bytes of the frame, for kYes (kNeedMore, kBadCheck: as far as known)
};

/// `bytes` starts at the possible start of the frame; `before` is the preceding byte, or -1 if unknown. After kYes the
/// view refers to the frame.
MatchResult match_frame(const MessageType& kind, std::span<const std::uint8_t> bytes, int before, FrameView& view);

/// Counts since the decoder was created; reset() keeps them.
struct DecoderCounters {
  std::uint64_t bytes = 0;
  std::uint64_t frames = 0;         ///< good frames of all message types
  std::uint64_t bad_check = 0;      ///< candidates with the right sync and length whose check failed
  std::uint64_t bad_length = 0;     ///< candidates with an invalid length field, or without an end
  std::uint64_t bad_body = 0;       ///< candidates that violate a body rule
  std::uint64_t refused = 0;        ///< intact frames that a refuse rule rejects: the device reports a fault
  std::uint64_t skipped_bytes = 0;  ///< bytes that are not part of a good frame
  std::uint64_t resyncs = 0;        ///< interruptions of a sequence of good frames: one per damaged range
  std::uint64_t timeouts = 0;       ///< candidates dropped after a time without data
  std::uint64_t unconfirmed = 0;    ///< matching frames with a weak check that were not confirmed by a second one
  std::uint64_t out_of_range = 0;   ///< field values outside the range of their description
};

/// Looks for a frame at every offset: after a failed candidate the search continues at its second byte, so a good frame
/// after or inside a bad one is never lost. The readings (offset, values) depend only on the bytes, not on their
/// chunks; their times depend only on the chunks' arrival times, not on timers.
///
/// If all checks of a message type have less than 16 bits, the first frame after a start (or after a long time without
/// frames) is held until the next frame, directly after it, confirms it.
///
/// A candidate without its end blocks the bytes after it. After a time without data of twice the wire time of the
/// longest frame, at least 5 ms, the decoder looks for good frames after the candidate; if it finds one, it drops the
/// candidate. Otherwise it keeps waiting, so that a frame split by a USB adapter (16 ms) or a stalled machine
/// is never lost.
///
/// Memory: at most one frame and one slice of input (16 KiB); no allocation per frame.
class FrameDecoder {
 public:
  explicit FrameDecoder(FrameDescriptionPtr description);

  /// Decodes the next bytes of the stream; `arrival_ns` is the arrival of the last of them and never decreases. Appends
  /// to `out`.
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns, std::vector<DecodedMessage>& out);

  /// Call on a live line's timer: no data since the last feed until `now_ns`. Readings come earlier; without it the
  /// next feed would find the same ones.
  void expire(std::int64_t now_ns, std::vector<DecodedMessage>& out);

  /// Call at the end of the stream: decodes the remaining bytes.
  void finish(std::vector<DecodedMessage>& out);

  /// Starts a new session of the device: forgets held bytes and slow channels; offsets and counters continue.
  void reset();

  /// True while bytes of an unfinished candidate are held: expire() may have an effect.
  bool waiting() const { return held_bytes() > 0; }
  /// Arrival of the chunk in which the frame ended.
  std::int64_t chunk_arrival_ns(const DecodedMessage& reading) const;
  /// Arrival of the oldest chunk in which a pending frame can end; nullopt if no bytes are held.
  std::optional<std::int64_t> held_since_ns() const {
    return waiting() && !chunk_ends_.empty() ? std::optional(chunk_ends_.front().arrival_ns) : std::nullopt;
  }
  /// End of the bytes that are decided: frames, or none; offset in the stream, as DecodedMessage::offset.
  std::uint64_t decided() const { return held_offset_; }
  const DecoderCounters& counters() const { return counters_; }
  /// MessageDecoder::unread_text().
  const std::string& unread_text() const { return maker_.unread_text(); }
  const FrameDescription& description() const { return *description_; }
  const FrameDescriptionPtr& description_ptr() const { return description_; }
  /// Bytes that are not decided yet.
  std::size_t held_bytes() const { return static_cast<std::size_t>(counters_.bytes - held_offset_); }

 private:
  /// The bytes up to stream offset `end` had arrived at `arrival_ns`.
  struct ChunkEnd {
    std::uint64_t end = 0;
    std::int64_t arrival_ns = 0;
  };
  enum class Mode {
    kMore,
    kSilent,
    kEnd
  };  ///< action if the end is missing: wait; try later candidates meanwhile; drop
  struct Candidate {
    Match match = Match::kNoSync;
    std::int32_t kind = -1;
    std::uint32_t length = 0;
    std::uint32_t bad_length = 0, bad_body = 0, refused = 0, bad_check = 0,
                  unconfirmed = 0;  ///< message types that failed here, by cause
    std::uint32_t damaged = 0;      ///< bytes of a frame with gyro data whose check failed; 0: none
  };

  void scan(Mode mode, std::vector<DecodedMessage>& out);
  bool look_behind(std::vector<DecodedMessage>& out);
  Candidate look_at(std::size_t at, Mode mode);
  Candidate try_kinds(std::size_t at, Mode mode, FrameView& view);
  bool accepted_at_once(const MessageType& kind, std::uint64_t begin) const;
  bool confirmed(std::size_t at, const Candidate& candidate, Mode mode, bool& need_more);
  bool counter_steps(const FrameView& before, std::int32_t kind_before, const FrameView& behind,
                     std::int32_t kind) const;
  void count(const Candidate& candidate);
  std::size_t next_possible(std::size_t at) const;
  bool skip_trailer(std::size_t at);
  void skip(std::size_t bytes);
  void accept(std::size_t at, const Candidate& candidate, std::vector<DecodedMessage>& out);
  void set_arrival(DecodedMessage& reading, std::uint64_t end) const;
  void drop_held(std::size_t bytes);

  FrameDescriptionPtr description_;
  MessageDecoder maker_;
  FrameView view_;
  DecoderCounters counters_;
  double byte_time_ns_ = 0;
  std::int64_t timeout_ns_ = 0;
  std::array<std::uint64_t, 256> kinds_by_first_byte_{};  ///< bit k: message type k may begin with this byte
  int only_first_byte_ = -1;                              ///< if all message types begin with the same byte; else -1

  std::vector<std::uint8_t> held_;    ///< bytes not decided yet
  std::uint64_t held_offset_ = 0;     ///< of the first byte in the stream that is not decided
  int before_held_ = -1;              ///< the byte before held_[0]
  std::vector<ChunkEnd> chunk_ends_;  ///< of the chunks that overlap held_, oldest first
  std::int64_t last_arrival_ns_ = 0;

  bool locked_ = false;              ///< frames of weak message types are accepted at once
  bool in_run_ = false;              ///< the previous byte was the end of a good frame
  std::uint64_t last_good_end_ = 0;  ///< in the stream
  std::int32_t last_kind_ = -1;
  std::size_t trailer_at_ = 0;          ///< bytes of last_kind_'s trailer seen after the last frame
  std::uint32_t damaged_ = 0;           ///< frames since the last one with gyro data
  std::uint64_t damaged_until_ = 0;     ///< end of the last of them in the stream
  std::uint64_t lost_after_bytes_ = 0;  ///< the lock is lost after this many bytes without a good frame
};

}  // namespace prism::wire
