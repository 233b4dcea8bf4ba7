// SPDX-License-Identifier: MIT
// Builds frames from the same description that decodes them: the simulator and the round-trip tests speak through it.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/wire/frame_description.hpp"

namespace prism {

/// What the device would measure over one frame's interval.
struct GyroState {
  double rate_deg_per_h = 0;  ///< mean over the interval
  double interval_s = 0;      ///< > 0
  double temperature_degc = 0;
  double uhfo_v = 0;
  std::uint32_t status = 0;  ///< bits besides those that say "valid", which the encoder sets
  bool valid = true;
};

/// Keeps what the device keeps: counter, accumulated angle, and what is left of the angle below one pulse, so that no
/// part of the rate is lost to quantisation. Frames of the kinds that carry the gyro come in the description's order
/// (one kind: always that one); slow channels take their turns.
class FrameEncoder {
 public:
  explicit FrameEncoder(FrameDescriptionPtr description);

  /// Appends one whole frame.
  void encode(const GyroState& state, std::vector<std::uint8_t>& out);

  /// The device measured `frames` intervals but sent nothing: the counter (and an accumulated angle, with the state's
  /// rate) go on.
  void skip(const GyroState& state, std::uint64_t frames);

 private:
  void advance(const GyroState& state);

  FrameDescriptionPtr description_;
  std::uint64_t frame_number_ = 0;
  double ticks_ = 0;
  double angle_ = 0;      ///< units of Reading::gyro, below one unit: what is not sent yet
  double sent_angle_ = 0;  ///< accumulated, modulo GyroRule::wrap
};

}  // namespace prism
