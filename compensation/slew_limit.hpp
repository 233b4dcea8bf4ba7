// SPDX-License-Identifier: MIT
// Limits the change of the published bias per row to the fastest change in the model's training record.
#pragma once

#include <cstdint>
#include <optional>

#include "compensation/model.hpp"

namespace prism::compensation {

struct SlewSettings {
  bool limited = true;
  std::optional<double> max_slew_deg_per_h_per_s;  ///< > 0; none: derived from the model

  bool operator==(const SlewSettings&) const = default;
};

/// kSlewMargin · (largest − smallest bias over the training box) / length_s, deg/h per second. The fastest change
/// within the training box crosses all of it in one window: a ramp that reverses at once moves the slope through its
/// range in length_s, and no mean over length_s changes faster. The margin is for a least-squares slope, which responds
/// 1.5 times as fast in the middle of its window, and for curved models, which are steeper at the edge. Without a box,
/// ±max_bias_deg_per_h replaces the span. At least kLeastSlew, one last digit of the log per row. Infinite if nothing
/// is limited.
inline constexpr double kSlewMargin = 4, kLeastSlew = 1e-6;
double greatest_slew_deg_per_h_per_s(const Model& model, const SlewSettings& settings, double max_bias_deg_per_h);

/// Limits the bias of one model. The first value, and the first one of another model, is not limited.
class SlewLimit {
 public:
  /// `bias_deg_per_h`, finite, is the prediction of `by` at the end of `second`; moves it to the value to publish.
  /// Returns true if it was moved. `most_deg_per_h_per_s`: > 0.
  bool follow(double& bias_deg_per_h, std::int64_t second, const Model& by, double most_deg_per_h_per_s);
  void reset() { by_ = nullptr; }

 private:
  const Model* by_ = nullptr;  ///< the model of the last bias; only compared
  double bias_deg_per_h_ = 0;
  std::int64_t second_ = 0;
};

}  // namespace prism::compensation
