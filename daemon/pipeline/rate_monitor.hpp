// SPDX-License-Identifier: MIT
// Detects a wrong rate_hz in the frame description, from the samples' times.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace prism::pipeline {

/// Counts samples per full second. Works with time stamps of the gyro and with the clock "host". Cannot work if the
/// times are computed from rate_hz (clock "device" with a frame counter or without a counter).
class RateMonitor {
 public:
  explicit RateMonitor(double rate_hz) : rate_hz_(rate_hz) {}

  /// Adds the number of samples of a full second. Returns a message, once, if the median of 30 consecutive seconds
  /// differs from rate_hz by more than 10 % and at most 10 % of them differ from the median (unlike a line that loses
  /// frames now and then).
  std::optional<std::string> push(std::uint32_t samples);
  /// Call at a new session: discards the seconds before it.
  void begin() { seconds_.clear(); }

 private:
  double rate_hz_;
  std::vector<std::uint32_t> seconds_;
  bool reported_ = false;
};

}  // namespace prism::pipeline
