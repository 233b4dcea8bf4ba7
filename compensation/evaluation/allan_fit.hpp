// SPDX-License-Identifier: MIT
// The strengths of the noises of an Allan curve, with intervals, from its octave points alone.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "compensation/evaluation/allan.hpp"

namespace prism::evaluation {

/// The Allan variance of a series at clusters of m values.
struct AllanVariance {
  std::size_t m = 0;
  double raw = 0;           ///< as it is
  double flat = 0;          ///< without the series' slope
  std::size_t windows = 0;  ///< pairs of clusters that count
  double share = 1;         ///< of all pairs; the rest has missing values
};

/// Variance at cluster size m: 3 q / m² + s / m + b + k m / 3, in squares of the rate's unit, time in samples.
using NoiseStrengths = std::array<double, 4>;

struct AllanFit {
  NoiseStrengths noise{};       ///< the best fit
  AllanCoefficients strengths;  ///< intervals or bounds of q, s, b, k, and of the rate's slope per sample
  std::vector<double> misses;   ///< each octave's distance from the fit, in standard deviations
};

/// Fits the four noises to the octaves (m is a power of two) and decides whether the slope is a ramp or a random walk.
///
/// The degrees of freedom of a point are those of NIST SP 1065 (2008, table 5) for each noise, and two points are
/// correlated by their distance in octaves. The cube root of a variance is nearly normal (Wilson and Hilferty 1931), so
/// the fit is a weighted non-negative least-squares fit, repeated with the weights of its result. An interval ends
/// where the score of one strength, with the others fitted again, is ±1; a bound where it is −1.645. A strength is
/// given if its score at 0 is above 3 and it has 30 % of the variance at some octave. `slope`: (mean of the last third
/// − mean of the first) / their distance. It is a ramp if it exceeds three standard deviations with the largest random
/// walk; if it exceeds them with the fitted noises only, neither is given. At least three octaves with flat > 0
/// somewhere.
AllanFit fit_allan(std::size_t n, double slope, const std::vector<AllanVariance>& octaves);

/// Degrees of freedom of the variance of a mixture of noises at any cluster size up to n / 2.
double allan_edf(std::size_t n, std::size_t m, const NoiseStrengths& noise);

}  // namespace prism::evaluation
