// SPDX-License-Identifier: MIT
// Sees a frame description whose rate_hz is not the gyro's, by the samples' own times.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace prism::pipeline {

/// Counts the samples of whole seconds. Times that are made of rate_hz itself (a counter of frames, or no counter, on
/// the clock "device") cannot tell; time stamps of the gyro and the clock "host" can.
class RateWatch {
 public:
  explicit RateWatch(double rate_hz) : rate_hz_(rate_hz) {}

  /// A full second had so many samples. What is wrong, in one line, once: where the median of 30 seconds in a row is
  /// off rate_hz by more than a tenth and no more than a tenth of them differ from it (a line that loses frames now and
  /// then does).
  std::optional<std::string> push(std::uint32_t samples);
  /// A new session: seconds before it are no longer counted.
  void begin() { seconds_.clear(); }

 private:
  double rate_hz_;
  std::vector<std::uint32_t> seconds_;
  bool told_ = false;
};

}  // namespace prism::pipeline
