// SPDX-License-Identifier: MIT
// Noise coefficients of an Allan curve: random walks, bias instability, ramp and quantisation, each only if determined.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "compensation/evaluation/allan_confidence.hpp"

namespace prism::evaluation {

/// One coefficient with its interval.
struct AllanCoefficient {
  double value = 0;
  double low = 0, high = 0;
  double relative_sd = 0;  ///< half the width of the interval of 1 sigma / value
  double from_tau_s = 0,
         to_tau_s = 0;  ///< the range in which this is the largest noise; else where its part is largest
};

/// The Allan minimum: always exists, but is not the bias instability.
struct AllanFloor {
  double minimum_deg_per_h = 0;
  double tau_s = 0;
  bool edge_limited = false;  ///< the minimum is the last point: a longer record would have a lower one
  std::size_t clusters = 0;   ///< clusters of the minimum; unreliable below 20, nearly meaningless below 5
  double low_deg_per_h = 0, high_deg_per_h = 0;  ///< interval of the minimum's point
};

/// Every coefficient but R has an interval, which may begin at 0; one that is not determined has no value (nullopt). R
/// has an interval only if it is determined; at_most is then an upper end without a lower one.
struct AllanCoefficients {
  std::optional<AllanCoefficient> quantisation_arcsec;
  std::optional<AllanCoefficient> angle_random_walk_deg_per_sqrt_h;
  std::optional<AllanCoefficient> bias_instability_deg_per_h;
  std::optional<AllanCoefficient> rate_random_walk_deg_per_h_sqrt_h;
  std::optional<AllanCoefficient> rate_ramp_deg_per_h_h;
  std::array<double, kNoiseTypes> at_least{}, at_most{};  ///< ends of each interval, in the order of NoiseType
  double misfit = 0;                                      ///< AllanModel::misfit()
  AllanFloor floor;
};

/// B = plateau / kAllanFlicker, sqrt(2 ln 2 / pi) (IEEE Std 952).
inline constexpr double kAllanFlicker = 0.6642824703;

/// The coefficients of the IEEE Std 952 sum for a rate in deg/h, tau in s and tau_h in hours, all terms >= 0:
///   σ²(tau) = 3 Q² / tau² + N² / tau_h + B² (2 ln 2 / pi) + K² tau_h / 3 + R² tau_h² / 2
/// N² is the two-sided power spectral density of the rate noise (IEEE Std 952-1997, annex C: S(f) = N²), and
/// σ(tau) = N / sqrt(tau); white_noise_density() has other definitions.
///
/// Intervals: strength_interval(). They are given whether or not the noise is found, so that they hold the truth with
/// their probability, which is 0 for a noise that the rate does not have. The value is the best fit, or the end of the
/// interval next to it. A coefficient is determined if 0 is three standard deviations away (AllanModel::distance). R:
/// the slope and its standard deviation; determined if AllanModel::ramp_is_certain, and not
/// if the points show B without K: a hidden K would make the slope less certain. B, if the noises do not describe
/// the curve (misfit): only with three octave points whose slopes are below 0.1 and which are not above both ends of
/// the curve (noise with one correlation time).
///
/// `octaves`, `model`: the overlapping octave curve and its model. Errors: fewer than three points.
Result<AllanCoefficients> extract_coefficients(const AllanCurve& octaves, const AllanModel& model, double probability,
                                               const std::string& where);

/// The white noise N of a rate in other definitions.
struct WhiteNoiseDensity {
  /// N as MATLAB's Allan variance example states it: σ of the line of slope −1/2 at 1 s, in (rad/s)/√Hz. The definition
  /// is that of IEEE Std 952, only the unit differs.
  double matlab_rad_per_s_per_sqrt_hz = 0;
  /// The root of the one-sided power spectral density, as data sheets and spectrum estimates (pwelch) give it: √2 N.
  double one_sided_deg_per_s_per_sqrt_hz = 0;
};

WhiteNoiseDensity white_noise_density(double angle_random_walk_deg_per_sqrt_h);

}  // namespace prism::evaluation
