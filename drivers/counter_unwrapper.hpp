// SPDX-License-Identifier: MIT
// Unwraps the counter from one reading to the next; detects lost and repeated frames.
#pragma once

#include <cstdint>
#include <optional>

#include "drivers/wire/decode/decoded_message.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::drivers {

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
