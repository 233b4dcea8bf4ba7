// SPDX-License-Identifier: MIT
// Plausibility alarm with hysteresis: reports once when a sensor becomes implausible, once when it recovers.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "compensation/compensated.hpp"
#include "daemon/pipeline/notice.hpp"

namespace prism::pipeline {

/// Returns a notice for each sensor that becomes implausible, and another when it was plausible for kCalmS of data
/// time, so that a flickering sensor is one fault. A new session or a clock set back does not end a fault.
class PlausibilityAlarm {
 public:
  static constexpr int kCalmS = 30;

  /// Rows must be passed in order of creation. Texts: "temperature is implausible: found -273 degC, expected -90 to
  /// 200".
  std::vector<Notice> push(const compensation::CompensatedWindow& row);

 private:
  struct Episode {
    bool open = false;
    int calm_s = 0;                   ///< rows since the last implausible one
    std::uint64_t implausible_s = 0;  ///< rows
  };
  std::array<Episode, 3> episodes_;
};

}  // namespace prism::pipeline
