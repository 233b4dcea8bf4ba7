// SPDX-License-Identifier: MIT
// Detects a wrong rate_hz in the frame description, from the samples' times.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/frame_rate_check.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::pipeline {

/// How described and arrival times disagree, in one line; empty if they do not.
std::string clocks_text(const wire::FrameDescription& frames, const drivers::FrameRateCheck& check);

/// Counts samples per full second, for gyros with time tags. Without them (FrameDescription::counts_frames()) the times
/// follow from rate_hz, and FrameRateCheck compares it with the arrivals.
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
