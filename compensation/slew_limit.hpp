// SPDX-License-Identifier: MIT
// How fast a published bias may change: no row steps further than the model's own training record could have made it.
#pragma once

#include <cstdint>
#include <optional>

#include "compensation/model.hpp"

namespace prism::compensation {

struct SlewSettings {
  bool limited = true;
  std::optional<double> max_slew_deg_per_h_per_s;  ///< > 0; none: the model's own

  bool operator==(const SlewSettings&) const = default;
};

/// kSlewMargin · (greatest − smallest bias over the training box) / length_s, deg/h per second. The fastest that a
/// record of the training box can do is to cross the whole of it in one window: a ramp that reverses at once takes the
/// slope through its range in length_s, and no mean over length_s changes faster. The margin is for a least-squares
/// slope, which answers 1.5 times as fast in the middle of its window, and for curved models, steeper at the edge.
/// A model that does not say its box: what is believed at all, ±max_bias_deg_per_h, in the place of its span. Never
/// less than kLeastSlew, a last digit of the log in a row. Infinite where nothing is limited.
inline constexpr double kSlewMargin = 4, kLeastSlew = 1e-6;
double greatest_slew_deg_per_h_per_s(const Model& model, const SlewSettings& settings, double max_bias_deg_per_h);

/// Holds the bias of one model after the other. The first one is taken as it is, as is the first of another model.
class SlewLimit {
 public:
  /// `bias_deg_per_h`, finite, is what `by` says at the end of `second`; moves it to what may be published. True where
  /// it was moved. `most_deg_per_h_per_s`: > 0.
  bool follow(double& bias_deg_per_h, std::int64_t second, const Model& by, double most_deg_per_h_per_s);
  void reset() { by_ = nullptr; }

 private:
  const Model* by_ = nullptr;  ///< who gave the last one; only compared
  double bias_deg_per_h_ = 0;
  std::int64_t second_ = 0;
};

}  // namespace prism::compensation
