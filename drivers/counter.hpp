// SPDX-License-Identifier: MIT
// The device's counter: rejects single wrong values, and unwraps it from one reading to the next.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/wire/decode/decoded_message.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::drivers {

/// A frame whose counter jumps by more than kNearFrames, or back, is held until the next counted frame. It is rejected
/// if the next counter lies between the one before the jump and its own: then the frame counts as lost. Otherwise the
/// jump is real (lost frames, a restarted device) and both frames pass. Messages without the counter always pass.
class CounterCheck {
 public:
  static constexpr double kNearFrames = 4;

  explicit CounterCheck(wire::FrameDescriptionPtr description);

  /// Returns the frames that pass because of this reading, in order: none, one or two. Valid until the next call, and
  /// as long as `reading`.
  std::span<const wire::DecodedMessage> push(const wire::DecodedMessage& reading) {
    if (!rule_ || !reading.has_counter) return {&reading, 1};
    if (held_ || !is_near(reading.counter)) return decide(reading);
    last_ = reading.counter;
    return {&reading, 1};
  }
  /// The session ends: returns the held frame, if any, and forgets the counters.
  std::span<const wire::DecodedMessage> finish();

  std::uint64_t rejected() const { return rejected_; }  ///< frames, since the start

 private:
  std::span<const wire::DecodedMessage> decide(const wire::DecodedMessage& reading);
  bool is_near(std::uint64_t counter) const {
    return !last_ || static_cast<double>(rule_->ticks_between(*last_, counter)) <= near_ticks_;
  }

  std::optional<wire::CounterRule> rule_;  ///< none: the description has no counter
  double near_ticks_ = 0;
  std::optional<std::uint64_t> last_;  ///< counter of the last frame that passed
  std::optional<wire::DecodedMessage> held_;
  std::array<wire::DecodedMessage, 2> passed_;
  std::uint64_t rejected_ = 0;
};

struct CounterStep {
  double ticks = 0;              ///< of CounterRule; frames if the description has no counter
  std::uint32_t missing = 0;     ///< frames lost in between
  std::uint32_t by_arrival = 0;  ///< of these: derived from arrival times only, because the counter may have wrapped
  bool duplicate = false;        ///< the same counter again
  bool restarted = false;        ///< the counter value is not a possible successor; `ticks` is one frame then
};

/// True if the reading waited to be read since the one before, which arrived elapsed_s earlier: its chunk contains
/// more than the line delivers at once.
bool waited_to_be_read(const wire::DecodedMessage& reading, double period_s, double elapsed_s);

/// The counter's difference modulo its modulus. If arrival times may be used, a gap of more than a second may contain
/// full periods of the counter: as many are added as the arrivals show, unless the bytes arrived in one large chunk,
/// that is, had been waiting. If they may not be used, a counter that goes back by less than half its modulus was
/// restarted (if it covers at least 64 frames; a shorter one cannot distinguish this from loss).
///
/// Without a counter each frame with gyro data is one step, also one whose check failed; other bytes between frames
/// are not, because a device may send anything there. An uncounted frame between counted ones takes no step.
class CounterUnwrapper {
 public:
  CounterUnwrapper(wire::FrameDescriptionPtr description, bool by_arrival);

  /// `slope`: estimated host seconds per nominal device second. The first reading's step is 0.
  CounterStep push(const wire::DecodedMessage& reading, double slope);
  void reset();

  /// Minimum number of ticks that can be lost unseen: a counter period, or a frame without a counter; 0: none.
  double unseen_ticks() const;
  std::uint32_t frames_of(double ticks) const;

 private:
  double frame_ticks() const;
  CounterStep step_to(const wire::DecodedMessage& reading, double slope) const;
  CounterStep uncounted(const wire::DecodedMessage& reading) const;
  double unseen_turns(const wire::DecodedMessage& reading, double ticks, double slope) const;

  wire::FrameDescriptionPtr description_;
  bool by_arrival_;
  bool running_ = false;
  std::int64_t last_arrival_ns_ = 0;  ///< of any message type
  std::optional<std::uint64_t> last_counter_;
};

}  // namespace prism::drivers
