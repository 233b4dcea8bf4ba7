// SPDX-License-Identifier: MIT
// Rejects single frames whose counter is wrong although their check sum is right.
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

}  // namespace prism::drivers
