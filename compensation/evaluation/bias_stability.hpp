// SPDX-License-Identifier: MIT
// Bias stability before and after compensation, the floor that no model can go below, and what share was explained.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {

/// "Bias stability" of a laser gyro: the standard deviation (1 sigma) of non-overlapping means, 100 s unless said
/// otherwise, deg/h. Not the Allan minimum ("bias instability"); both names are in use for all three numbers.
struct BiasStability {
  Divisor divisor = Divisor::kNMinus1;
  SummaryStatistics before;  ///< raw bias, deg/h
  SummaryStatistics after;   ///< bias − predicted bias, deg/h
  /// (before.sd − after.sd) / before.sd; nothing where the raw bias does not move at all.
  std::optional<double> improvement;
  /// Standard deviation that white noise alone gives a block mean, deg/h, from first differences of the raw blocks:
  /// sqrt(Σ(x_{k+1} − x_k)² / (2M), M pairs of neighbours. Nothing where no two blocks are neighbours.
  std::optional<double> floor_deg_per_h;
  /// (s_raw² − s_res²) / (s_raw² − s_floor²): 1 = a better model could not help; nothing where the raw bias does not
  /// rise above its floor. May exceed 1 a little: the floor is an estimate.
  std::optional<double> explained;
};

/// Before and after over the same blocks. `follows` (block i begins where block i − 1 ended) has the length of the
/// series or is empty, which means that all do. Refused: lengths that differ, fewer than two blocks, values not finite.
Result<BiasStability> measure_bias_stability(std::span<const double> raw, std::span<const double> corrected,
                                             const std::vector<bool>& follows, Divisor divisor,
                                             const std::string& where);

/// The floor alone: sqrt(Σ(x_{k+1} − x_k)² / 2M) over the M pairs of neighbours, deg/h. Slow movement cancels in first
/// differences, so this is the white part. Nothing where there is no pair.
std::optional<double> noise_floor(std::span<const double> blocks, const std::vector<bool>& follows);

}  // namespace prism::evaluation
