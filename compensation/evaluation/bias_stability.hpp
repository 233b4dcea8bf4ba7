// SPDX-License-Identifier: MIT
// Bias stability before and after compensation, its white-noise floor, and the explained fraction.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {

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
/// series, or is empty if all blocks follow each other. Errors: different lengths, fewer than two blocks, values that
/// are not finite.
Result<BiasStability> measure_bias_stability(std::span<const double> raw, std::span<const double> corrected,
                                             const std::vector<bool>& follows, Divisor divisor,
                                             const std::string& where);

/// The floor alone: sqrt(Σ(x_{k+1} − x_k)² / 2M) over the M pairs of neighbours, deg/h. Slow drift cancels in first
/// differences, so this is the white part. Returns nullopt without a pair.
std::optional<double> noise_floor(std::span<const double> blocks, const std::vector<bool>& follows);

}  // namespace prism::evaluation
