// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_confidence.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>

namespace prism::evaluation {
namespace {

/// Cluster means of the longest stretch without a hole.
std::vector<double> longest_clusters(std::span<const double> rate, std::size_t m) {
  std::size_t best = 0, best_length = 0;
  for (std::size_t i = 0; i < rate.size();) {
    std::size_t end = i;
    while (end < rate.size() && std::isfinite(rate[end])) ++end;
    if (end - i > best_length) best_length = end - (best = i);
    i = end + 1;
  }
  std::vector<double> means;
  means.reserve(best_length / m);
  for (std::size_t k = 0; (k + 1) * m <= best_length; ++k) {
    double sum = 0;
    for (std::size_t i = 0; i < m; ++i) sum += rate[best + k * m + i];
    means.push_back(sum / static_cast<double>(m));
  }
  return means;
}

/// r_1 of a series; nothing where it does not move.
double lag_one(const std::vector<double>& values) {
  double mean = 0;
  for (const double value : values) mean += value;
  mean /= static_cast<double>(values.size());
  double variance = 0, covariance = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    variance += (values[i] - mean) * (values[i] - mean);
    if (i > 0) covariance += (values[i] - mean) * (values[i - 1] - mean);
  }
  return variance > 0 ? covariance / variance : 0;
}

NoiseType from_alpha(long alpha) {
  if (alpha >= 2) return NoiseType::kQuantisation;
  if (alpha == 1) return NoiseType::kFlickerAngle;
  if (alpha == 0) return NoiseType::kAngleRandomWalk;
  if (alpha == -1) return NoiseType::kBiasInstability;
  return NoiseType::kRateRandomWalk;
}

double overlapping_edf(NoiseType type, double n, double m) {
  switch (type) {
    case NoiseType::kQuantisation:
      return (n + 1) * (n - 2 * m) / (2 * (n - m));
    case NoiseType::kFlickerAngle:
      return std::exp(std::sqrt(std::log((n - 1) / (2 * m)) * std::log((2 * m + 1) * (n - 1) / 4)));
    case NoiseType::kAngleRandomWalk:
      return (3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m * m / (4 * m * m + 5);
    case NoiseType::kBiasInstability:
      return m == 1 ? 2 * (n - 2) / (2.3 * n - 4.9) * (n - 2) : 5 * n * n / (4 * m * (n + 3 * m));
    case NoiseType::kRateRandomWalk:
      return (n - 2) / m * ((n - 1) * (n - 1) - 3 * m * (n - 1) + 4 * m * m) / ((n - 3) * (n - 3));
  }
  return 1;
}

}  // namespace

const char* noise_type_text(NoiseType type) {
  switch (type) {
    case NoiseType::kQuantisation:
      return "quantisation";
    case NoiseType::kFlickerAngle:
      return "flicker of angle";
    case NoiseType::kAngleRandomWalk:
      return "angle random walk";
    case NoiseType::kBiasInstability:
      return "bias instability";
    case NoiseType::kRateRandomWalk:
      return "rate random walk";
  }
  return "";
}

NoiseType identify_noise(std::span<const double> rate, std::size_t m, NoiseType fallback) {
  std::vector<double> values = longest_clusters(rate, m);
  if (values.size() < 30) return fallback;
  int differences = 0;
  double delta = 0;
  for (;; ++differences) {
    const double r = lag_one(values);
    delta = r / (1 + r);
    if (delta < 0.25 || differences == 2) break;
    for (std::size_t i = 0; i + 1 < values.size(); ++i) values[i] = values[i + 1] - values[i];
    values.pop_back();
  }
  return from_alpha(std::lround(-2 * delta) - 2 * differences);
}

double degrees_of_freedom(NoiseType type, std::size_t values, std::size_t m, AllanEstimator estimator) {
  const double n = static_cast<double>(values) + 1, clusters = static_cast<double>(m);
  if (n - 2 * clusters < 1 || n <= 3) return 1;
  const double edf = overlapping_edf(type, n, clusters);
  // Side by side, m clusters make one sample of a new record of white or slower noise: its edf is that at m = 1.
  const double side_by_side = std::floor((n - 1) / clusters);
  const double ceiling =
      estimator == AllanEstimator::kNonOverlapping ? overlapping_edf(type, std::max(4.0, side_by_side + 1), 1) : edf;
  return std::max(1.0, std::min(edf, ceiling));
}

std::vector<AllanInterval> allan_confidence(const AllanCurve& curve, std::span<const double> rate, double probability) {
  std::vector<AllanInterval> intervals;
  NoiseType type = NoiseType::kAngleRandomWalk;
  const double tail = 0.5 * (1 - probability);
  for (const AllanPoint& point : curve.points) {
    AllanInterval interval;
    interval.type = type = identify_noise(rate, point.m, type);
    interval.edf = degrees_of_freedom(type, curve.values, point.m, curve.estimator);
    const boost::math::chi_squared distribution(interval.edf);
    interval.low = point.deviation * std::sqrt(interval.edf / boost::math::quantile(complement(distribution, tail)));
    interval.high = point.deviation * std::sqrt(interval.edf / boost::math::quantile(distribution, tail));
    intervals.push_back(interval);
  }
  return intervals;
}

}  // namespace prism::evaluation
