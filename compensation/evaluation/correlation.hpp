// SPDX-License-Identifier: MIT
// Correlation of two series (the paper's Table 1), and autocorrelation.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::evaluation {

/// Pearson's coefficient, −1 to 1, no unit. Errors: different lengths, fewer than three pairs, a value that is not
/// finite, a constant series (its coefficient is not defined).
Result<double> correlate(std::span<const double> x, std::span<const double> y, const std::string& where);

struct Autocorrelation {
  std::vector<double> coefficient;  ///< lags 0 to max_lag, in samples; [0] = 1
  double band = 0;                  ///< ± 1.96 / sqrt(N): contains 95 % of the coefficients of a white series
};

/// r_k = Σ (x_i − m)(x_{i+k} − m) / Σ (x_i − m)², the biased form, always within ±1. max_lag is limited to N − 1.
/// Errors: fewer than three values, a value that is not finite, a constant series.
Result<Autocorrelation> autocorrelate(std::span<const double> values, std::size_t max_lag, const std::string& where);

}  // namespace prism::evaluation
