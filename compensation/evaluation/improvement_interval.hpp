// SPDX-License-Identifier: MIT
// 95 % prediction intervals: the improvement of further recordings of the same profile, from that of one or several.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {

/// Day-to-day change of the ratio of the sigmas, 1 sigma of its logarithm, in addition to the scatter within one
/// recording (another voltage, another turn-on). Assumed if there is only one recording; from simulated days,
/// docs/benchmarks.md.
inline constexpr double kBetweenDays = 0.09;

/// Fraction of the residual's scatter that repeats in the next recording, as from hidden temperature effects: it does
/// not contribute to their difference. Also from simulated days.
inline constexpr double kRepeats = 0.4;

/// The improvement 1 − sd(after)/sd(before), a fraction. Circular block bootstrap of the residual `after` on the fixed
/// prediction `before` − `after`, 1 000 resamples with a fixed seed. The interval uses Student's t on the logarithm of
/// the ratio, with one degree of freedom less than the recording has blocks, and kBetweenDays. The variance counts
/// twice, because the next recording scatters as much as this one, except for kRepeats. Returns nullopt for fewer than
/// 20 values, different lengths, values that are not finite, or a constant series.
std::optional<Estimate> next_improvement(std::span<const double> before, std::span<const double> after);

/// The improvement of `second` minus that of `first`, both corrections of the same recording `before`. Pairs are
/// resampled together, and day-to-day changes common to both cancel. Returns nullopt as above.
std::optional<Estimate> next_difference(std::span<const double> before, std::span<const double> first,
                                        std::span<const double> second);

/// 95 % prediction interval of the improvement, from the improvements of several recordings alone (fractions, each
/// below 1): Student's t on the logarithms of the remaining ratios, with the recordings' own scatter. `value` is their
/// mean. Returns nullopt for fewer than 3, or one that is not finite or not below 1.
std::optional<Estimate> next_of_several(std::span<const double> improvements);

/// Number of neighbours to resample together: the block length with the smallest error of a mean's variance, from the
/// autocorrelation (Politis and White 2004, corrected by Patton, Politis and White 2009), 1 to a quarter of the values.
/// Returns 1 for a constant series.
std::size_t bootstrap_block(std::span<const double> values);

}  // namespace prism::evaluation
