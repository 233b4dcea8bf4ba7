// SPDX-License-Identifier: MIT
// What an Allan curve says about a gyro: random walks, bias instability, ramp and quantisation, each only if it shows.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compensation/evaluation/allan_confidence.hpp"

namespace prism::evaluation {

/// One coefficient with the relative 1-sigma uncertainty that the points which carry it give.
struct AllanCoefficient {
  double value = 0;
  double relative_sd = 0;
  double from_tau_s = 0, to_tau_s = 0;  ///< where this noise is more than half of the variance
};

/// The Allan minimum: always there, but only an upper bound of the bias instability.
struct AllanFloor {
  double minimum_deg_per_h = 0;
  double tau_s = 0;
  bool edge_limited = false;  ///< the minimum is the last point: a longer record would show a lower one
  std::size_t clusters = 0;   ///< behind the minimum; below 20 with caution, below 5 hardly
};

/// A coefficient that is nowhere more than half of the variance is not resolved by this record: nothing.
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
/// plateau / kAllanFlicker: three octave points or more of 9 clusters or more, |slope| <= 0.1 between neighbours, that
/// do not stand above both ends of the curve; without one there is no B and no B in the sum. `intervals` belongs to
/// `curve`, which must be an octave curve. Refused: fewer than three points, a record that does not move.
Result<AllanCoefficients> extract_coefficients(const AllanCurve& curve, const std::vector<AllanInterval>& intervals,
                                               const std::string& where);

}  // namespace prism::evaluation
