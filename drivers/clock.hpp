// SPDX-License-Identifier: MIT
// Gives readings their place in time: counter unwrapped, missing frames known, stamps one can trust. Never waits.
#pragma once

#include <cstdint>
#include <optional>

#include "compensation/sample.hpp"
#include "drivers/wire/frame_description.hpp"
#include "drivers/wire/reading.hpp"

namespace prism {

enum class ClockSource {
  kHost,    ///< arrival times of this machine, de-jittered by the device's counter
  kDevice,  ///< first arrival + counter x nominal period: fast replays, and devices with a trustworthy clock
};

struct ClockSettings {
  ClockSource source = ClockSource::kHost;
  double switch_s = 100;  ///< host: the two windows of the fit take turns after this many seconds; 10 to 3600
  double residual_limit_s = 0.020;  ///< host: a stamp that is off by more begins a new fit; > 0
};

struct ClockStatus {
  std::uint64_t samples = 0;
  std::uint64_t missing_frames = 0;
  std::uint64_t duplicates = 0;      ///< frames with the counter of the frame before: no sample
  std::uint64_t resets = 0;          ///< fits begun anew: counter reset or residual over the limit (not reset())
  double period_s = 0;               ///< the frame period in use: estimated (host) or nominal
  bool period_is_estimated = false;  ///< false: still the nominal one
  double residual_s = 0;             ///< host: how late the last frame came, beyond the fitted line
};

/// One Reading in, at most one Sample out. The first reading of an angle (increment over an unknown time, or accumulated)
/// gives no sample: there is nothing to take the difference to.
class Clock {
 public:
  Clock(FrameDescriptionPtr description, ClockSettings settings = {});

  std::optional<Sample> push(const Reading& reading);

  /// The line was opened again: a new session. Stamps may start anywhere.
  void reset();

  const ClockStatus& status() const { return status_; }

 private:
  FrameDescriptionPtr description_;
  ClockSettings settings_;
  ClockStatus status_;
};

}  // namespace prism
