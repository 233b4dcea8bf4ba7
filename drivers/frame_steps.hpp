// SPDX-License-Identifier: MIT
// How far the device has come from one reading to the next: its counter unwrapped, lost and repeated frames known.
#pragma once

#include <cstdint>
#include <optional>

#include "drivers/wire/decode/reading.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::drivers {

struct FrameStep {
  double ticks = 0;              ///< of CounterRule; without a counter in the description: frames
  std::uint32_t missing = 0;     ///< frames between, lost
  std::uint32_t by_arrival = 0;  ///< of these: known by the arrival times only, as the counter may have wrapped
  bool duplicate = false;        ///< the same counter again
  bool restarted = false;        ///< the counter cannot have come here by counting; `ticks` is one frame then
};

/// The counter's difference modulo its modulus. Where arrivals may be asked, a silence of more than a second may hide
/// whole turns of the counter: as many are added as the arrivals say; but not where so many bytes came at once that
/// they had waited to be read: that was no silence. Where they may not, a counter that comes back by less than half its
/// modulus was restarted (if it holds at least 64 frames; a smaller one cannot tell that from loss).
///
/// In a stream without a counter each frame that carries the gyro is one step; frames lost on the line are known from
/// the bytes skipped there, where the stream has one kind of frame. An uncounted frame between counted ones takes no
/// step.
class FrameSteps {
 public:
  FrameSteps(wire::FrameDescriptionPtr description, bool by_arrival);

  /// `slope`: host seconds per nominal device second, as far as known. The first reading's step is 0.
  FrameStep push(const wire::Reading& reading, double slope);
  void reset();

  /// The least number of ticks that can be lost unseen: a turn of the counter, without one a frame; 0: none can.
  double unseen_ticks() const;
  std::uint32_t frames_of(double ticks) const;

 private:
  double frame_ticks() const;
  FrameStep step_to(const wire::Reading& reading, double slope) const;
  FrameStep uncounted(const wire::Reading& reading) const;
  double counted_ticks(const wire::Reading& reading) const;
  double unseen_turns(const wire::Reading& reading, double ticks, double slope) const;
  double frames_by_offset(const wire::Reading& reading) const;

  wire::FrameDescriptionPtr description_;
  bool by_arrival_;
  bool running_ = false;
  wire::Reading last_;  ///< of any kind
  std::optional<std::uint64_t> last_counter_;
};

}  // namespace prism::drivers
