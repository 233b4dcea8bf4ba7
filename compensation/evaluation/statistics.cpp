// SPDX-License-Identifier: MIT
#include "compensation/evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace prism::evaluation {

const char* divisor_text(Divisor divisor) { return divisor == Divisor::kN ? "N" : "N-1"; }

double neumaier_sum(std::span<const double> values) {
  double sum = 0, lost = 0;
  for (const double value : values) {
    const double next = sum + value;
    lost += std::abs(sum) >= std::abs(value) ? (sum - next) + value : (value - next) + sum;
    sum = next;
  }
  return sum + lost;
}

Result<SummaryStatistics> summarise(std::span<const double> values, Divisor divisor, const std::string& where) {
  if (values.size() < 2) {
    return make_error(where, "a standard deviation needs 2 values or more, found " + std::to_string(values.size()));
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) return make_error(where, "value " + std::to_string(i) + " is not a finite number");
  }
  const double n = static_cast<double>(values.size());
  SummaryStatistics summary;
  summary.count = values.size();
  summary.mean = neumaier_sum(values) / n;

  // Two passes: the deviations are small numbers, so nothing cancels; their sum corrects the rounding error of the mean
  // (Chan, Golub and LeVeque 1983).
  double deviations = 0, squares = 0, about_zero = 0;
  for (const double value : values) {
    const double deviation = value - summary.mean;
    deviations += deviation;
    squares += deviation * deviation;
    about_zero += value * value;
  }
  const double sum_of_squares = std::max(0.0, squares - deviations * deviations / n);
  summary.sd = std::sqrt(sum_of_squares / (divisor == Divisor::kN ? n : n - 1));
  summary.rms = std::sqrt(about_zero / n);
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  summary.min = *low;
  summary.max = *high;
  summary.peak_to_peak = *high - *low;
  if (summary.peak_to_peak == 0) summary.sd = 0;  // equal values: removes the rounding error of their mean
  return summary;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

double median_absolute_deviation(const std::vector<double>& values) {
  const double centre = median_of(values);
  std::vector<double> distances;
  distances.reserve(values.size());
  for (const double value : values) distances.push_back(std::abs(value - centre));
  return median_of(std::move(distances));
}

}  // namespace prism::evaluation
