// SPDX-License-Identifier: MIT
// Confidence of an Allan deviation: noise type, equivalent degrees of freedom, chi-square interval.
#pragma once

#include <vector>

#include "compensation/evaluation/allan.hpp"
#include "compensation/evaluation/allan_model.hpp"

namespace prism::evaluation {

/// One point with its interval: deviation · sqrt(edf / chi2) at both tails; with few clusters, chi2 has the skewness of
/// the estimate.
struct AllanInterval {
  NoiseType type = NoiseType::kAngleRandomWalk;  ///< the noise with the largest part of the fitted variance
  double edf = 1;                                ///< equivalent degrees of freedom; infinite for a ramp without noise
  double deviation = 0;                          ///< the point's, without the noise that missing values add
  double low = 0, high = 0;                      ///< in the rate's unit
  /// False if missing values add more than two fifths of the variance for the noises of the model, or more than half
  /// for those that fit best if the point is three standard deviations too high. It then tells hardly anything about
  /// the rate.
  bool determined = true;
};

/// Intervals of all points at `probability` (0.683 is "1 sigma"), in the order of curve.points. `model` is that of the
/// record's overlapping octave points. The degrees of freedom are 2 E² / Var of the Allan variance for the fitted
/// noises (Greenhall and Riley 2003), so a point with few clusters is not judged by these clusters alone. Below 200
/// each end is computed for the noises that fit best if the truth is at that end.
std::vector<AllanInterval> allan_confidence(const AllanCurve& curve, const AllanModel& model, double probability);

}  // namespace prism::evaluation
