// SPDX-License-Identifier: MIT
// Noise of a rate: Allan deviation with the five coefficients Q, N, B, K, R of IEEE Std 952, each only if it is
// certain, and power spectral density with its periodic parts.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::evaluation {

/// In a series of rates, a missing value is NaN; this value separates two records.
inline constexpr double kAllanBreak = std::numeric_limits<double>::infinity();

/// Noises of a rate, in the order of IEEE Std 952. σ²(tau) = 3 Q²/tau² + N²/tau_h + B² (2 ln 2 / pi) + K² tau_h/3 +
/// R² tau_h²/2, for a rate in deg/h, tau in s and tau_h in hours.
enum class NoiseType { kQuantisation, kAngleRandomWalk, kBiasInstability, kRateRandomWalk, kRateRamp };

inline constexpr std::size_t kNoiseTypes = 5;

const char* noise_type_text(NoiseType type);

/// The Allan variance of a bias instability B is B² · kFlicker.
inline constexpr double kFlicker = 0.4412712003;  // 2 ln 2 / pi

/// Other definitions of the white noise N, whose two-sided density is N² (IEEE Std 952). MATLAB's example reads the
/// same N from the Allan deviation at 1 s, in (rad/s)/√Hz; data sheets and pwelch give the one-sided density, √2 N.
inline double matlab_rad_per_s_per_sqrt_hz(double n_deg_per_sqrt_h) {
  return n_deg_per_sqrt_h / 60 * std::numbers::pi / 180;
}
inline double one_sided_deg_per_s_per_sqrt_hz(double n_deg_per_sqrt_h) {
  return n_deg_per_sqrt_h / 60 * std::numbers::sqrt2;
}

/// One averaging time. tau_s = m · tau0.
struct AllanPoint {
  std::size_t m = 0;
  double tau_s = 0;
  double deviation = 0;                           ///< in the rate's unit
  double low = 0, high = 0;                       ///< 68 % interval of the true deviation
  double edf = 0;                                 ///< degrees of freedom of the variance, for the fitted noises
  std::size_t windows = 0;                        ///< pairs of clusters that count
  NoiseType noise = NoiseType::kAngleRandomWalk;  ///< the one with the largest part of the variance
};

/// A coefficient with its 68 % interval, or without a value: then it is at most `high` (95 %).
struct AllanCoefficient {
  std::optional<double> value;
  double low = 0, high = 0;
};

/// Units: arcsec, deg/√h, deg/h, (deg/h)/√h, (deg/h)/h.
using AllanCoefficients = std::array<AllanCoefficient, kNoiseTypes>;

inline const AllanCoefficient& coefficient(const AllanCoefficients& all, NoiseType type) {
  return all[static_cast<std::size_t>(type)];
}

struct AllanAnalysis {
  double tau0_s = 0;
  std::size_t values = 0, missing = 0;                           ///< finite values, and NaN
  std::size_t holes = 0;                                         ///< runs of missing values and breaks
  std::vector<AllanPoint> points;                                ///< at the averaging times of the grid
  Result<AllanCoefficients> coefficients = AllanCoefficients{};  ///< from octaves, or the reason without them
  /// The octaves that the five noises miss by more than four standard deviations: the rate oscillates, or has noise of
  /// one time constant.
  std::vector<double> unexplained_s;

  const AllanPoint& minimum() const;  ///< the point with the least deviation
};

/// The overlapping Allan deviation of a rate in deg/h (NIST SP 1065, 2008, eq. 11) at octaves up to an eighth of the
/// series,
///   σ²(m) = Σ_j (x_{j+2m} − 2 x_{j+m} + x_j)² / (2 m² n),  x_j = Σ_{i<j} y_i,
/// and the coefficients that fit the octaves (allan_fit.hpp). Not detrended; records between breaks are pooled.
///
/// Missing values: a pair of clusters counts if 95 % of the values of each are there. Each mean is then of the values
/// that are there, and the difference is scaled to the variance of white noise in complete clusters. The degrees of
/// freedom fall with the pairs that do not count; a point with less than two for a random walk is left out.
///
/// Memory: the series itself. Coefficients need three octaves: 32 values. Errors: tau0 not positive; no point; a rate
/// that does not vary.
Result<AllanAnalysis> analyse_allan(std::vector<double> rate, double tau0_s, const std::string& where);

/// The deviation at one averaging time; 0 if no pair of clusters counts.
double allan_deviation(std::vector<double> rate, std::size_t m);

/// A periodic part of the rate.
struct SpectralLine {
  double frequency_hz = 0;
  double amplitude = 0;  ///< of a sine, in the rate's unit
};

struct Spectrum {
  /// One-sided density, squares of the rate's unit per Hz, averaged over at most 40 intervals of equal ratio per
  /// decade. White noise N (deg/√h) has 2 N² · 3600 (deg/h)²/Hz.
  std::vector<double> frequency_hz, density;
  std::vector<SpectralLine> lines;  ///< the largest first, at most 10
  std::size_t segments = 0, segment_values = 0;
};

/// Welch's estimate (1967): Hann windows that overlap by half, each without its mean, of at most an eighth of the
/// values. Missing values (NaN, kAllanBreak) count as the mean; a segment with less than 95 % of its values is left
/// out. A line is a peak that noise with the density of its neighbours would reach in one of a thousand spectra.
/// Errors: no segment of 64 values.
Result<Spectrum> power_spectrum(std::span<const double> rate, double tau0_s, const std::string& where);

}  // namespace prism::evaluation
