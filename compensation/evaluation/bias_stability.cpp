// SPDX-License-Identifier: MIT
#include "compensation/evaluation/bias_stability.hpp"

#include <fmt/format.h>

#include <cmath>

namespace prism::evaluation {

std::optional<double> noise_floor(std::span<const double> blocks, const std::vector<bool>& follows) {
  double squares = 0;
  std::size_t pairs = 0;
  for (std::size_t i = 1; i < blocks.size(); ++i) {
    if (!follows.empty() && !follows[i]) continue;
    const double step = blocks[i] - blocks[i - 1];
    squares += step * step;
    ++pairs;
  }
  if (pairs == 0) return std::nullopt;
  return std::sqrt(squares / (2.0 * static_cast<double>(pairs)));
}

Result<BiasStability> measure_bias_stability(std::span<const double> raw, std::span<const double> corrected,
                                             const std::vector<bool>& follows, Divisor divisor,
                                             const std::string& where) {
  if (raw.size() != corrected.size() || (!follows.empty() && follows.size() != raw.size())) {
    return make_error(where, fmt::format("found {} raw and {} corrected blocks, expected equal numbers", raw.size(),
                                         corrected.size()));
  }
  const auto before = summarise(raw, divisor, where + ", raw");
  if (!before) return tl::unexpected(before.error());
  const auto after = summarise(corrected, divisor, where + ", corrected");
  if (!after) return tl::unexpected(after.error());

  BiasStability result{divisor, *before, *after, {}, noise_floor(raw, follows), {}};
  if (before->sd > 0) result.improvement = (before->sd - after->sd) / before->sd;
  if (result.floor_deg_per_h) {
    const double floor = *result.floor_deg_per_h;
    const double explainable = before->sd * before->sd - floor * floor;
    // below a hundredth of the variance the ratio would be noise divided by noise
    if (explainable > 0.01 * before->sd * before->sd) {
      result.explained = (before->sd * before->sd - after->sd * after->sd) / explainable;
    }
  }
  return result;
}

}  // namespace prism::evaluation
