// SPDX-License-Identifier: MIT
#include "compensation/evaluation/statistics.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

namespace prism::evaluation {
namespace {

/// The deviations from the mean, scaled to at most 1 (squares of very small ones would underflow); nullopt if no
/// correlation is defined.
std::optional<std::vector<double>> deviations(std::span<const double> values) {
  const auto summary = summarise(values, Divisor::kN);
  if (values.size() < 3 || !summary || summary->peak_to_peak == 0) return std::nullopt;
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

double mean_of(std::span<const double> values) { return neumaier_sum(values) / static_cast<double>(values.size()); }

std::optional<SummaryStatistics> summarise(std::span<const double> values, Divisor divisor) {
  const auto finite = [](double value) { return std::isfinite(value); };
  if (values.size() < 2 || !std::all_of(values.begin(), values.end(), finite)) return std::nullopt;
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

std::optional<double> correlate(std::span<const double> x, std::span<const double> y) {
  const auto dx = deviations(x), dy = deviations(y);
  if (x.size() != y.size() || !dx || !dy) return std::nullopt;
  const double r = dot(*dx, *dy, 0) / std::sqrt(dot(*dx, *dx, 0) * dot(*dy, *dy, 0));
  return std::clamp(r, -1.0, 1.0);
}

std::optional<Autocorrelation> autocorrelate(std::span<const double> values, std::size_t max_lag) {
  const auto d = deviations(values);
  if (!d) return std::nullopt;
  // From the power spectrum of the series, padded so that its ends do not meet (Wiener and Khinchin): each lag by
  // itself would take minutes for the blocks of a year.
  std::vector<double> products(*d);
  products.resize(std::bit_ceil(2 * d->size()));
  Eigen::FFT<double> transform;
  std::vector<std::complex<double>> bins;
  transform.fwd(bins, products);
  for (std::complex<double>& bin : bins) bin = std::norm(bin);
  transform.inv(products, bins);
  Autocorrelation result;
  for (std::size_t lag = 0; lag <= std::min(max_lag, values.size() - 1); ++lag)
    result.coefficient.push_back(products[lag] / products[0]);
  result.band = 1.96 / std::sqrt(static_cast<double>(values.size()));
  return result;
}

double neighbour_correlation(std::span<const double> values) {
  const auto d = deviations(values);
  return d ? dot(*d, *d, 1) / dot(*d, *d, 0) : 0;
}

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

BiasStability measure_bias_stability(std::span<const double> raw, std::span<const double> corrected,
                                     const std::vector<bool>& follows, Divisor divisor) {
  assert(raw.size() == corrected.size() && (follows.empty() || follows.size() == raw.size()));
  const SummaryStatistics before = summarise(raw, divisor).value(), after = summarise(corrected, divisor).value();
  BiasStability result{divisor, before, after, {}, noise_floor(raw, follows), {}};
  if (before.sd > 0) result.improvement = (before.sd - after.sd) / before.sd;
  if (result.floor_deg_per_h) {
    const double floor = *result.floor_deg_per_h;
    const double explainable = before.sd * before.sd - floor * floor;
    // below a hundredth of the variance the ratio would be noise divided by noise
    if (explainable > 0.01 * before.sd * before.sd) {
      result.explained = (before.sd * before.sd - after.sd * after.sd) / explainable;
    }
  }
  return result;
}

}  // namespace prism::evaluation
