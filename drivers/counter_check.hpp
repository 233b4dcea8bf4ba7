// SPDX-License-Identifier: MIT
// Rejects single frames whose counter is wrong although their check sum is right.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

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

  /// True if the reading passes at once; call take() otherwise.
  bool passes(const wire::DecodedMessage& reading) {
    if (!applies_ || !reading.has_counter) return true;
    if (held_ || (last_ && ticks_after_last(reading.counter) > near_ticks_)) return false;
    last_ = reading.counter;
    return true;
  }
  /// Appends the frames that pass because of this reading, in order.
  void take(const wire::DecodedMessage& reading, std::vector<wire::DecodedMessage>& passed);
  /// The session ends: appends the held frame.
  void finish(std::vector<wire::DecodedMessage>& passed);
  /// Forgets the counters; a new session begins.
  void reset();

  std::uint64_t rejected() const { return rejected_; }  ///< frames, since the start

 private:
  double ticks_after_last(std::uint64_t counter) const;

  bool applies_;
  std::uint64_t modulus_ = 0;  ///< 0: 2^64
  double near_ticks_ = 0;
  std::optional<std::uint64_t> last_;  ///< counter of the last frame that passed
  std::optional<wire::DecodedMessage> held_;
  std::uint64_t rejected_ = 0;
};

}  // namespace prism::drivers
