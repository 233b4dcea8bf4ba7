// SPDX-License-Identifier: MIT
// Tells once that a sensor is not believed, and once that it is again.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "compensation/compensated.hpp"

namespace prism::pipeline {

/// One notice for each sensor as it becomes implausible, one when it has been plausible for kCalmS of data time: a
/// sensor that flickers is one fault. Sessions come and go, and a sensor's fault with the clock set back lasts on.
class PlausibilityWatch {
 public:
  static constexpr int kCalmS = 30;

  struct Notice {
    bool entered;
    std::string text;  ///< "temperature is implausible: found -273 degC, expected -90 to 200"
  };
  /// Rows in the order in which they came to be.
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
