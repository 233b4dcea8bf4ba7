// SPDX-License-Identifier: MIT
// Prediction intervals: the improvement of further recordings, from that of one or several.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "base/result.hpp"

namespace prism::evaluation {

/// Day-to-day change of the ratio of the sigmas, 1 sigma of its logarithm, in addition to the scatter within one
/// recording (another voltage, another turn-on). Assumed if there is only one recording; from simulated days,
/// docs/benchmarks.md.
inline constexpr double kBetweenDays = 0.09;

/// Fraction of the residual's scatter that repeats in the next recording, as from hidden temperature effects: it does
/// not contribute to their difference. Also from simulated days.
inline constexpr double kRepeats = 0.4;

/// A value of one recording, and its 95 % prediction interval for further recordings of the same profile.
struct PredictionInterval {
  double value = 0;       ///< of this recording
  double low = 0;         ///< 2.5 % of further recordings are below
  double high = 0;        ///< 2.5 % are above
  std::size_t block = 0;  ///< values per resampled block

  /// Returns true if the interval contains zero: the next recording may show the opposite, or no effect.
  bool holds_zero() const { return low <= 0 && high >= 0; }
};

/// The improvement 1 − sd(after)/sd(before), a fraction. Circular block bootstrap of the residual `after` on the fixed
/// prediction `before` − `after`, 1 000 resamples with a fixed seed. The interval uses Student's t on the logarithm of
/// the ratio, with one degree of freedom less than the recording has blocks, and kBetweenDays. The variance counts
/// twice, because the next recording scatters as much as this one, except for kRepeats. Errors: fewer than 20 values,
/// different lengths, values that are not finite, a constant series.
Result<PredictionInterval> next_improvement(std::span<const double> before, std::span<const double> after,
                                            const std::string& where);

/// The improvement of `second` minus that of `first`, both corrections of the same recording `before`. Pairs are
/// resampled together, and day-to-day changes common to both cancel. Errors: as above.
Result<PredictionInterval> next_difference(std::span<const double> before, std::span<const double> first,
                                           std::span<const double> second, const std::string& where);

/// 95 % prediction interval of the improvement, from the improvements of several recordings alone (fractions, each
/// below 1): Student's t on the logarithms of the remaining ratios, with the recordings' own scatter. `value` is their
/// mean, `block` 1. Errors: fewer than 3, or one that is not finite or not below 1.
Result<PredictionInterval> next_of_several(std::span<const double> improvements, const std::string& where);

/// Number of neighbours to resample together: the block length with the smallest error of a mean's variance, from the
/// autocorrelation (Politis and White 2004, corrected by Patton, Politis and White 2009), 1 to a quarter of the values.
/// Returns 1 for a constant series.
std::size_t bootstrap_block(std::span<const double> values);

}  // namespace prism::evaluation
