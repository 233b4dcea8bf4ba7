// SPDX-License-Identifier: MIT
// Sensitivities of a bias to measured causes and its warm-up, with intervals that allow for correlated noise, and the
// scatter of switch-ons.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {

/// Means of one switch-on of the gyro, or of a recording without one; its level is its own.
struct DriftRecord {
  std::vector<double> time_s;  ///< increasing; since switch-on, if there was one
  std::vector<double> bias_deg_per_h;
  std::vector<std::vector<double>> causes;  ///< of each cause the values, in an order that all records share
  bool switched_on = false;
};

struct DriftFit {
  std::vector<Estimate> causes;  ///< change of the bias per unit of each cause
  /// From switch-on until the exponential part is below the band, h. Nullopt: the records do not determine it.
  std::optional<Estimate> warm_up_h;
};

/// Fits bias = level of the record + Σ coefficient · cause + A exp(−t / τ_w) + noise by generalised least squares; A is
/// common to all switch-ons. The noise is white, plus flicker (Ornstein-Uhlenbeck processes from two blocks to ten
/// times the longest record) or one such process. Its parameters and τ_w are a grid, weighted by the restricted
/// likelihood, so that the intervals contain their uncertainty. Finite values. Returns nullopt for fewer blocks
/// than kFewestBlocks and one more for each record, and for causes that are constant or change together.
inline constexpr std::size_t kFewestBlocks = 20;
std::optional<DriftFit> fit_drift(const std::vector<DriftRecord>& records, double warm_up_band_deg_per_h);

/// Mean of at least two normal values, with Student's interval.
Estimate mean_with_interval(std::span<const double> values);
/// Their standard deviation, with the interval of chi-square with n − 1 degrees of freedom.
Estimate scatter_with_interval(std::span<const double> values);

}  // namespace prism::evaluation
