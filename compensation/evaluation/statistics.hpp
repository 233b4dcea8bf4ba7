// SPDX-License-Identifier: MIT
// The numbers in every table of a report: mean, standard deviation with a named divisor, median, correlation, and the
// bias stability before and after compensation with its white-noise floor.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace prism::evaluation {

/// Divisor of the sum of squared deviations. Laser-gyro literature seldom states it; every output names it.
enum class Divisor {
  kN,        ///< the population's: σ² = Σ(x − m)² / N
  kNMinus1,  ///< the sample's:     s² = Σ(x − m)² / (N − 1)
};

/// "N" or "N-1", as reports print it.
const char* divisor_text(Divisor divisor);

/// A value with its 95 % interval.
struct Estimate {
  double value = 0, low = 0, high = 0;

  bool holds_zero() const { return low <= 0 && high >= 0; }
};

/// Location and scale of one series, in its own unit.
struct SummaryStatistics {
  std::size_t count = 0;
  double mean = 0;
  double sd = 0;   ///< about the mean, with the given divisor
  double rms = 0;  ///< about zero, divisor N
  double min = 0, max = 0;
  double peak_to_peak = 0;  ///< max − min
};

/// Returns nullopt for fewer than two values or one that is not finite.
std::optional<SummaryStatistics> summarise(std::span<const double> values, Divisor divisor);

/// Sum with compensated rounding errors (Neumaier 1974): exact to the last bit or two in any order of values.
double neumaier_sum(std::span<const double> values);
/// Their mean; NaN of none.
double mean_of(std::span<const double> values);

/// Middle value, the mean of the two middle ones for an even count. `values` must not be empty or contain NaN.
double median_of(std::vector<double> values);

/// median|x − median(x)|. Not empty, no NaN.
double median_absolute_deviation(const std::vector<double>& values);

/// 1 / Φ⁻¹(3/4): the standard deviation of normal data in units of their median absolute deviation.
inline constexpr double kMadToSd = 1.4826;
/// A standard deviation of normal data that outliers do not affect. Not empty, no NaN.
inline double robust_sd(const std::vector<double>& values) { return kMadToSd * median_absolute_deviation(values); }

/// Pearson's coefficient, −1 to 1, no unit. Returns nullopt for different lengths, fewer than three pairs, a value that
/// is not finite, or a constant series (its coefficient is not defined).
std::optional<double> correlate(std::span<const double> x, std::span<const double> y);

struct Autocorrelation {
  std::vector<double> coefficient;  ///< lags 0 to max_lag, in samples; [0] = 1
  double band = 0;                  ///< ± 1.96 / sqrt(N): contains 95 % of the coefficients of a white series
};

/// r_k = Σ (x_i − m)(x_{i+k} − m) / Σ (x_i − m)², the biased form, always within ±1. max_lag is limited to N − 1.
/// Returns nullopt for fewer than three values, a value that is not finite, or a constant series.
std::optional<Autocorrelation> autocorrelate(std::span<const double> values, std::size_t max_lag);
/// r_1; 0 if it is undefined.
double neighbour_correlation(std::span<const double> values);

/// "Bias stability" of a laser gyro: the standard deviation (1 sigma) of non-overlapping means, of 100 s by default,
/// deg/h. Not the Allan minimum ("bias instability"), although both names are in use for both numbers.
struct BiasStability {
  Divisor divisor = Divisor::kNMinus1;
  SummaryStatistics before;  ///< raw bias, deg/h
  SummaryStatistics after;   ///< bias − predicted bias, deg/h
  /// (before.sd − after.sd) / before.sd; nullopt if the raw bias is constant.
  std::optional<double> improvement;
  /// Standard deviation of a block mean caused by white noise alone, deg/h, from first differences of the raw blocks:
  /// sqrt(Σ(x_{k+1} − x_k)² / (2M)), M pairs of neighbours. Nullopt without neighbours.
  std::optional<double> floor_deg_per_h;
  /// (s_raw² − s_res²) / (s_raw² − s_floor²): 1 = a better model would not help; nullopt if the raw bias does not
  /// exceed its floor. May exceed 1 slightly, because the floor is an estimate.
  std::optional<double> explained;
};

/// Before and after over the same blocks. `follows` (block i begins at the end of block i − 1) has the length of the
/// series, or is empty if all blocks follow each other. Requires at least two blocks of each, all finite.
BiasStability measure_bias_stability(std::span<const double> raw, std::span<const double> corrected,
                                     const std::vector<bool>& follows, Divisor divisor);

/// The floor alone: sqrt(Σ(x_{k+1} − x_k)² / 2M) over the M pairs of neighbours, deg/h. Slow drift cancels in first
/// differences, so this is the white part. Returns nullopt without a pair.
std::optional<double> noise_floor(std::span<const double> blocks, const std::vector<bool>& follows);

}  // namespace prism::evaluation
