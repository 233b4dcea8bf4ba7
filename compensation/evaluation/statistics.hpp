// SPDX-License-Identifier: MIT
// Mean, standard deviation with a named divisor, rms, min, max and median: the numbers in every table of a report.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::evaluation {

/// Divisor of the sum of squared deviations. Laser-gyro literature seldom states it; every output names it.
enum class Divisor {
  kN,        ///< the population's: σ² = Σ(x − m)² / N
  kNMinus1,  ///< the sample's:     s² = Σ(x − m)² / (N − 1)
};

/// "N" or "N-1", as reports print it.
const char* divisor_text(Divisor divisor);

/// Location and scale of one series, in its own unit.
struct SummaryStatistics {
  std::size_t count = 0;
  double mean = 0;
  double sd = 0;   ///< about the mean, with the given divisor
  double rms = 0;  ///< about zero, divisor N
  double min = 0, max = 0;
  double peak_to_peak = 0;  ///< max − min
};

/// Errors: fewer than two values; a value that is not finite (with its index). `where` names the series.
Result<SummaryStatistics> summarise(std::span<const double> values, Divisor divisor, const std::string& where);

/// Sum with compensated rounding errors (Neumaier 1974): exact to the last bit or two in any order of values.
double neumaier_sum(std::span<const double> values);

/// Middle value, the mean of the two middle ones for an even count. `values` must not be empty or contain NaN.
double median_of(std::vector<double> values);

/// median|x − median(x)|. Not empty, no NaN.
double median_absolute_deviation(const std::vector<double>& values);

/// 1 / Φ⁻¹(3/4): the standard deviation of normal data in units of their median absolute deviation.
inline constexpr double kMadToSd = 1.4826;
/// A standard deviation of normal data that outliers do not affect. Not empty, no NaN.
inline double robust_sd(const std::vector<double>& values) { return kMadToSd * median_absolute_deviation(values); }

}  // namespace prism::evaluation
