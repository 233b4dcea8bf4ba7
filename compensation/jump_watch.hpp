// SPDX-License-Identifier: MIT
// Tells a jump that stays from a spike.
#pragma once

#include <cmath>
#include <optional>
#include <utility>

#include "compensation/plausibility.hpp"

namespace prism::compensation {

/// For the values of one sensor, in order. A jump is rejected as too fast until the sensor could have reached it slowly
/// (SensorCheck); the first plausible value afterwards shows whether it stayed.
class JumpWatch {
 public:
  struct Jump {
    double before = kUnknown, after = kUnknown;  ///< the last value before it, and the value that is now used
  };
  void reject(const Rejection& rejection) {
    if (rejection.reason != Rejection::Reason::kTooFast) return;
    if (!is_rejecting()) before_ = (rejection.low + rejection.high) / 2;
    last_ = rejection.found;
  }
  /// A plausible value. Returns the jump if it stayed.
  std::optional<Jump> accept(double value) {
    const Jump jump{std::exchange(before_, kUnknown), value};
    const bool stays = std::fabs(value - last_) < std::fabs(value - jump.before);
    return stays ? std::optional(jump) : std::nullopt;
  }
  bool is_rejecting() const { return !std::isnan(before_); }

 private:
  double before_ = kUnknown, last_ = kUnknown;
};

}  // namespace prism::compensation
