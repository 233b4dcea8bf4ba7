// SPDX-License-Identifier: MIT
// Confidence of an Allan deviation: noise type, equivalent degrees of freedom, chi-square interval.
#pragma once

#include <span>
#include <vector>

#include "compensation/evaluation/allan.hpp"

namespace prism::evaluation {

/// Power-law noise of a rate, S(f) ∝ f^alpha, with its name in gyro practice and in the frequency standards.
enum class NoiseType {
  kQuantisation,     ///< alpha = +2, white phase noise: slope −1
  kFlickerAngle,     ///< alpha = +1, flicker phase noise: slope −1
  kAngleRandomWalk,  ///< alpha =  0, white frequency noise: slope −1/2
  kBiasInstability,  ///< alpha = −1, flicker frequency noise: slope 0
  kRateRandomWalk,   ///< alpha = −2, random walk of frequency: slope +1/2; also used for steeper noise
};

const char* noise_type_text(NoiseType type);

/// Noise type at cluster size m from the lag-1 autocorrelation r of the cluster means (Riley and Greenhall 2004): delta
/// = r / (1 + r); difference while delta >= 0.25; alpha = −2 delta − 2 d, rounded. Ignores neighbours across a gap.
/// Returns `fallback` for fewer than 30 clusters.
NoiseType identify_noise(std::span<const double> rate, std::size_t m, NoiseType fallback);

/// Equivalent degrees of freedom of the overlapping estimate (NIST SP 1065, table 5; `values` rate samples are
/// values + 1 phase points) or of the non-overlapping one (n terms, at most as many). At least 1.
double degrees_of_freedom(NoiseType type, std::size_t values, std::size_t m, AllanEstimator estimator);

/// The same for a record in segments of these lengths: gaps are not bridged, so each segment is a separate record.
double pooled_degrees_of_freedom(NoiseType type, std::span<const std::size_t> stretch_values, std::size_t m,
                                 AllanEstimator estimator);

/// One point with its interval: deviation · sqrt(edf / chi2) at both tails.
struct AllanInterval {
  NoiseType type = NoiseType::kAngleRandomWalk;
  double edf = 1;
  double low = 0, high = 0;  ///< in the rate's unit
};

/// Intervals of all points at `probability` (0.683 is "1 sigma"), in the order of curve.points.
std::vector<AllanInterval> allan_confidence(const AllanCurve& curve, std::span<const double> rate, double probability);

}  // namespace prism::evaluation
