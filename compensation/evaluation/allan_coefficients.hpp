// SPDX-License-Identifier: MIT
// Noise coefficients of an Allan curve: random walks, bias instability, ramp and quantisation, each only if resolved.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compensation/evaluation/allan_confidence.hpp"

namespace prism::evaluation {

/// One coefficient with its relative 1-sigma uncertainty, from the points that it dominates.
struct AllanCoefficient {
  double value = 0;
  double relative_sd = 0;
  double from_tau_s = 0, to_tau_s = 0;  ///< the range in which this noise is more than half of the variance
};

/// The Allan minimum: always exists, but is only an upper limit of the bias instability.
struct AllanFloor {
  double minimum_deg_per_h = 0;
  double tau_s = 0;
  bool edge_limited = false;  ///< the minimum is the last point: a longer record would have a lower one
  std::size_t clusters = 0;   ///< clusters of the minimum; unreliable below 20, nearly meaningless below 5
};

/// A coefficient that is nowhere more than half of the variance is not resolved by this record and is nullopt.
struct AllanCoefficients {
  std::optional<AllanCoefficient> quantisation_arcsec;
  std::optional<AllanCoefficient> angle_random_walk_deg_per_sqrt_h;
  std::optional<AllanCoefficient> bias_instability_deg_per_h;  ///< B; only with a plateau, see below
  std::optional<AllanCoefficient> rate_random_walk_deg_per_h_sqrt_h;
  std::optional<AllanCoefficient> rate_ramp_deg_per_h_h;
  AllanFloor floor;
};

/// B = plateau / kAllanFlicker, sqrt(2 ln 2 / pi) (IEEE Std 952).
inline constexpr double kAllanFlicker = 0.6642824703;

/// Fits the IEEE Std 952 sum to the octave points of a rate in deg/h, tau in s and tau_h in hours:
///   σ²(tau) = 3 Q² / tau² + N² / tau_h + B² (2 ln 2 / pi) + K² tau_h / 3 + R² tau_h² / 2,  all terms >= 0,
/// by least squares of the relative errors weighted with each point's degrees of freedom. B is the lowest point of a
/// plateau / kAllanFlicker. A plateau has three or more octave points with 9 or more clusters each, |slope| <= 0.1
/// between neighbours, and is not above both ends of the curve. Without a plateau, the sum contains no B. `intervals`
/// belongs to `curve`, which must be an octave curve. Errors: fewer than three points; a constant rate.
Result<AllanCoefficients> extract_coefficients(const AllanCurve& curve, const std::vector<AllanInterval>& intervals,
                                               const std::string& where);

}  // namespace prism::evaluation
