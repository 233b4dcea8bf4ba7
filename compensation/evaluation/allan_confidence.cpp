// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_confidence.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <numeric>
#include <utility>

namespace prism::evaluation {
namespace {

/// Lengths of the segments without a gap.
std::vector<std::size_t> segments(std::span<const double> rate) {
  std::vector<std::size_t> lengths;
  std::size_t length = 0;
  for (const double value : rate) {
    if (std::isfinite(value)) {
      ++length;
    } else if (length > 0) {
      lengths.push_back(std::exchange(length, 0));
    }
  }
  if (length > 0) lengths.push_back(length);
  return lengths;
}

using Series = std::vector<std::vector<double>>;

/// Cluster means, segment by segment: no cluster spans a gap.
Series cluster_means(std::span<const double> rate, std::size_t m) {
  Series series(1);
  std::size_t held = 0;
  double sum = 0;
  for (const double value : rate) {
    if (!std::isfinite(value)) {
      if (!series.back().empty()) series.emplace_back();
      held = 0;
      sum = 0;
      continue;
    }
    sum += value;
    if (++held < m) continue;
    series.back().push_back(sum / static_cast<double>(m));
    held = 0;
    sum = 0;
  }
  return series;
}

std::size_t count(const Series& series) {
  std::size_t all = 0;
  for (const auto& segment : series) all += segment.size();
  return all;
}

/// r_1 about the common mean, with neighbours within a segment only; 0 for a constant series.
double lag_one(const Series& series) {
  double mean = 0;
  for (const auto& segment : series) mean = std::accumulate(segment.begin(), segment.end(), mean);
  mean /= static_cast<double>(count(series));
  double variance = 0, covariance = 0, pairs = 0;
  for (const auto& segment : series) {
    for (std::size_t i = 0; i < segment.size(); ++i) {
      variance += (segment[i] - mean) * (segment[i] - mean);
      if (i == 0) continue;
      covariance += (segment[i] - mean) * (segment[i - 1] - mean);
      ++pairs;
    }
  }
  // A record of n without a gap has n − 1 pairs; with gaps it has fewer, and their sum is scaled up to n − 1.
  return variance > 0 && pairs > 0 ? covariance / variance * static_cast<double>(count(series) - 1) / pairs : 0;
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
  Series series = cluster_means(rate, m);
  if (count(series) < 30) return fallback;
  int differences = 0;
  double delta = 0;
  for (;; ++differences) {
    const double r = lag_one(series);
    delta = r / (1 + r);
    if (delta < 0.25 || differences == 2) break;
    for (auto& segment : series) {
      for (std::size_t i = 0; i + 1 < segment.size(); ++i) segment[i] = segment[i + 1] - segment[i];
      if (!segment.empty()) segment.pop_back();
    }
    if (count(series) < 2) break;
  }
  return from_alpha(std::lround(-2 * delta) - 2 * differences);
}

double degrees_of_freedom(NoiseType type, std::size_t values, std::size_t m, AllanEstimator estimator) {
  const double n = static_cast<double>(values) + 1, clusters = static_cast<double>(m);
  if (n - 2 * clusters < 1 || n <= 3) return 1;
  const double edf = overlapping_edf(type, n, clusters);
  // Adjacent clusters of m samples are the samples of a new record of white or slower noise: its edf is that at m = 1.
  const double side_by_side = std::floor((n - 1) / clusters);
  const double ceiling =
      estimator == AllanEstimator::kNonOverlapping ? overlapping_edf(type, std::max(4.0, side_by_side + 1), 1) : edf;
  return std::max(1.0, std::min(edf, ceiling));
}

// Each segment is a separate record: variances of n_i terms with edf_i degrees of freedom, pooled by their terms, have
// (Σ n_i)² / Σ (n_i² / edf_i) degrees of freedom (Welch and Satterthwaite).
double pooled_degrees_of_freedom(NoiseType type, std::span<const std::size_t> stretch_values, std::size_t m,
                                 AllanEstimator estimator) {
  double terms = 0, shares = 0;
  for (const std::size_t values : stretch_values) {
    if (values < 2 * m) continue;
    const double n =
        static_cast<double>(estimator == AllanEstimator::kOverlapping ? values - 2 * m + 1 : values / m - 1);
    terms += n;
    shares += n * n / degrees_of_freedom(type, values, m, estimator);
  }
  return shares > 0 ? std::max(1.0, terms * terms / shares) : 1;
}

std::vector<AllanInterval> allan_confidence(const AllanCurve& curve, std::span<const double> rate, double probability) {
  std::vector<AllanInterval> intervals;
  const std::vector<std::size_t> lengths = segments(rate);
  NoiseType type = NoiseType::kAngleRandomWalk;
  const double tail = 0.5 * (1 - probability);
  for (const AllanPoint& point : curve.points) {
    AllanInterval interval;
    interval.type = type = identify_noise(rate, point.m, type);
    interval.edf = pooled_degrees_of_freedom(type, lengths, point.m, curve.estimator);
    const boost::math::chi_squared distribution(interval.edf);
    interval.low = point.deviation * std::sqrt(interval.edf / boost::math::quantile(complement(distribution, tail)));
    interval.high = point.deviation * std::sqrt(interval.edf / boost::math::quantile(distribution, tail));
    intervals.push_back(interval);
  }
  return intervals;
}

}  // namespace prism::evaluation
