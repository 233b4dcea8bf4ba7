// SPDX-License-Identifier: MIT
#include "compensation/evaluation/correlation.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {
namespace {

/// The deviations from the mean, scaled to at most 1 (squares of very small ones would underflow), or the error.
Result<std::vector<double>> deviations(std::span<const double> values, const std::string& where) {
  if (values.size() < 3) {
    return make_error(where, "a correlation needs 3 values or more, found " + std::to_string(values.size()));
  }
  const auto summary = summarise(values, Divisor::kN, where);
  if (!summary) return tl::unexpected(summary.error());
  if (summary->peak_to_peak == 0) return make_error(where, "the series is constant: its correlation is not defined");
  std::vector<double> result(values.begin(), values.end());
  for (double& value : result) value = (value - summary->mean) / summary->peak_to_peak;
  return result;
}

double dot(const std::vector<double>& x, const std::vector<double>& y, std::size_t lag) {
  double sum = 0;
  for (std::size_t i = 0; i + lag < y.size(); ++i) sum += x[i] * y[i + lag];
  return sum;
}

}  // namespace

Result<double> correlate(std::span<const double> x, std::span<const double> y, const std::string& where) {
  if (x.size() != y.size()) {
    return make_error(where,
                      std::to_string(x.size()) + " against " + std::to_string(y.size()) + " values; expected as many");
  }
  const auto dx = deviations(x, where);
  if (!dx) return tl::unexpected(dx.error());
  const auto dy = deviations(y, where);
  if (!dy) return tl::unexpected(dy.error());
  const double r = dot(*dx, *dy, 0) / std::sqrt(dot(*dx, *dx, 0) * dot(*dy, *dy, 0));
  return std::clamp(r, -1.0, 1.0);
}

Result<Autocorrelation> autocorrelate(std::span<const double> values, std::size_t max_lag, const std::string& where) {
  const auto d = deviations(values, where);
  if (!d) return tl::unexpected(d.error());
  Autocorrelation result;
  const double variance = dot(*d, *d, 0);
  for (std::size_t lag = 0; lag <= std::min(max_lag, values.size() - 1); ++lag) {
    result.coefficient.push_back(dot(*d, *d, lag) / variance);
  }
  result.band = 1.96 / std::sqrt(static_cast<double>(values.size()));
  return result;
}

}  // namespace prism::evaluation
