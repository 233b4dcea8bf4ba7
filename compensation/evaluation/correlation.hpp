// SPDX-License-Identifier: MIT
// Correlation of two series (the paper's Table 1) and of a series with its own past.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::evaluation {

/// Pearson's coefficient, −1 to 1, no unit. Refused: lengths that differ, fewer than three pairs, a value that is not
/// finite, a series that does not move (the coefficient does not exist there).
Result<double> correlate(std::span<const double> x, std::span<const double> y, const std::string& where);

struct Autocorrelation {
  std::vector<double> coefficient;  ///< lags 0 to max_lag, in samples; [0] = 1
  double band = 0;                  ///< ± 1.96 / sqrt(N): 95 % of a white series stays inside
};

/// r_k = Σ (x_i − m)(x_{i+k} − m) / Σ (x_i − m)², the biased form, which never leaves ±1. max_lag is cut to N − 1.
/// Refused: fewer than three values, a value that is not finite, a constant series.
Result<Autocorrelation> autocorrelate(std::span<const double> values, std::size_t max_lag, const std::string& where);

}  // namespace prism::evaluation
