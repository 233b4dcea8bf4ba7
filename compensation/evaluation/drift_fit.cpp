// SPDX-License-Identifier: MIT
#include "compensation/evaluation/drift_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <utility>

namespace prism::evaluation {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kOutside = 0.025;  // at each end of an interval
constexpr double kTauRatio = 1.4;   // of neighbours in the first grid of τ_w

/// Correlated noise: processes with these time constants and the same variance, relative to the white noise of 1.
struct Noise {
  VectorXd tau_s;
  double variance;
  double prior;  ///< white noise alone, flicker, and one process are equally likely before the data
};

std::vector<Noise> noise_grid(double step_s, double longest_s) {
  std::vector<double> all;
  for (double tau = 2 * step_s; tau < 10 * longest_s; tau *= 4) all.push_back(tau);
  constexpr int kVariances = 29;
  const auto count = static_cast<double>(all.size());
  std::vector<Noise> grid = {{VectorXd::Constant(1, step_s), 0, kVariances * count}};
  for (int i = 0; i < kVariances; ++i) {
    const double variance = std::pow(10, 0.25 * i - 3);
    grid.push_back({VectorXd::Map(all.data(), static_cast<Index>(all.size())), variance, count});
    for (const double tau : all) grid.push_back({VectorXd::Constant(1, tau), variance, 1});
  }
  return grid;
}

/// Columns of a record: 1, the bias, the causes, exp(−t/τ_w) for each τ_w.
MatrixXd columns_of(const DriftRecord& record, const std::vector<double>& warm_up_s) {
  const VectorXd time = VectorXd::Map(record.time_s.data(), static_cast<Index>(record.time_s.size()));
  const auto causes = static_cast<Index>(record.causes.size());
  MatrixXd columns = MatrixXd::Zero(time.size(), 2 + causes + static_cast<Index>(warm_up_s.size()));
  columns.col(0).setOnes();
  columns.col(1) = VectorXd::Map(record.bias_deg_per_h.data(), time.size());
  for (Index c = 0; c < causes; ++c)
    columns.col(2 + c) = VectorXd::Map(record.causes[static_cast<std::size_t>(c)].data(), time.size());
  for (std::size_t w = 0; w < warm_up_s.size() && record.switched_on; ++w)
    columns.col(2 + causes + static_cast<Index>(w)) = (-time.array() / warm_up_s[w]).exp();
  return columns;
}

/// Makes the noise of each column white with variance 1 (Kalman filter). Returns the logarithm of the determinant of
/// its covariance.
double whiten(MatrixXd& columns, const std::vector<double>& time_s, const Noise& noise) {
  const Index states = noise.tau_s.size();
  MatrixXd mean = MatrixXd::Zero(states, columns.cols());
  MatrixXd covariance = MatrixXd::Identity(states, states) * noise.variance;
  double log_determinant = 0;
  for (Index i = 0; i < columns.rows(); ++i) {
    if (i > 0) {
      const auto now = static_cast<std::size_t>(i);
      const VectorXd kept = ((time_s[now - 1] - time_s[now]) / noise.tau_s.array()).exp();
      mean = kept.asDiagonal() * mean;
      covariance = kept.asDiagonal() * covariance * kept.asDiagonal();
      covariance.diagonal().array() += noise.variance * (1 - kept.array().square());
    }
    const VectorXd seen = covariance.rowwise().sum();
    const double variance = seen.sum() + 1;
    columns.row(i) -= mean.colwise().sum();
    mean += seen / variance * columns.row(i);
    covariance -= seen * seen.transpose() / variance;
    columns.row(i) /= std::sqrt(variance);
    log_determinant += std::log(variance);
  }
  return log_determinant;
}

/// The fit with one noise and one τ_w.
struct Point {
  double log_likelihood = -HUGE_VAL;
  VectorXd value, variance;  ///< of the causes, then of A
  double warm_up_s = 0;      ///< 0: without A
  std::size_t noise = 0;     ///< its position in the list
};

/// From the sums of products of the whitened columns.
Point solve(const MatrixXd& products, const std::vector<Index>& used, double freedom, double log_determinant) {
  const MatrixXd normal = products(used, used);
  const VectorXd right = products(used, 1);
  const Eigen::LDLT<MatrixXd> solver(normal);
  const VectorXd pivots = solver.vectorD();
  if (!(pivots.minCoeff() > 1e-12 * pivots.maxCoeff())) return {};
  Point point;
  point.value = solver.solve(right);
  const double rest = std::max(products(1, 1) - point.value.dot(right), 1e-300);
  point.variance = rest / freedom * solver.solve(MatrixXd::Identity(normal.rows(), normal.rows())).diagonal();
  point.log_likelihood = -0.5 * (log_determinant + pivots.array().log().sum() + freedom * std::log(rest));
  return point;
}

/// One point for each noise and τ_w.
std::vector<Point> fits(const std::vector<DriftRecord>& records, const std::vector<Noise>& noises,
                        const std::vector<double>& warm_up_s) {
  const std::size_t causes = records.front().causes.size();
  std::vector<Point> points;
  for (std::size_t n = 0; n < noises.size(); ++n) {
    const Noise& noise = noises[n];
    MatrixXd products;
    double log_determinant = -2 * std::log(noise.prior), freedom = 0;
    for (const DriftRecord& record : records) {
      MatrixXd columns = columns_of(record, warm_up_s);
      log_determinant += whiten(columns, record.time_s, noise);
      MatrixXd own = columns.transpose() * columns;
      log_determinant += std::log(own(0, 0));  // the level of the record is fitted: its part is removed
      own -= MatrixXd(own.col(0) * own.row(0) / own(0, 0));
      products = products.size() == 0 ? own : MatrixXd(products + own);
      freedom += static_cast<double>(columns.rows() - 1);
    }
    for (std::size_t w = 0; w < std::max<std::size_t>(1, warm_up_s.size()); ++w) {
      std::vector<Index> used;
      for (std::size_t c = 0; c < causes; ++c) used.push_back(static_cast<Index>(2 + c));
      if (!warm_up_s.empty()) used.push_back(static_cast<Index>(2 + causes + w));
      Point point = solve(products, used, freedom - static_cast<double>(used.size()), log_determinant);
      point.warm_up_s = warm_up_s.empty() ? 0 : warm_up_s[w];
      point.noise = n;
      if (std::isfinite(point.log_likelihood)) points.push_back(std::move(point));
    }
  }
  return points;
}

std::vector<double> weights_of(const std::vector<Point>& points) {
  double best = -HUGE_VAL, sum = 0;
  std::vector<double> weights;
  for (const Point& point : points) best = std::max(best, point.log_likelihood);
  for (const Point& point : points) sum += weights.emplace_back(std::exp(point.log_likelihood - best));
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// The points of the noises that are likely, for values of τ_w over the range of those that are likely.
std::vector<Point> refined(const std::vector<DriftRecord>& records, const std::vector<Noise>& noises,
                           const std::vector<Point>& points) {
  constexpr int kCount = 24;
  const std::vector<double> weights = weights_of(points);
  double low = HUGE_VAL, high = 0;
  std::size_t last = noises.size();
  std::vector<Noise> likely;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (weights[i] < 1e-4) continue;
    low = std::min(low, points[i].warm_up_s / kTauRatio), high = std::max(high, points[i].warm_up_s * kTauRatio);
    if (points[i].noise != std::exchange(last, points[i].noise)) likely.push_back(noises[last]);
  }
  std::vector<double> all;
  for (int i = 0; i < kCount; ++i) all.push_back(low * std::pow(high / low, static_cast<double>(i) / (kCount - 1)));
  return fits(records, likely, all);
}

/// The time, h, until |A| exp(−t/τ_w) is below the band, over all points and their weights.
std::optional<Estimate> warm_up_of(const std::vector<Point>& points, const std::vector<double>& weights, double band,
                                   double longest_h) {
  constexpr int kQuantiles = 41;
  std::vector<std::pair<double, double>> times;  // and their weights
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int q = 0; q < kQuantiles && points[i].warm_up_s > 0 && weights[i] > 1e-6; ++q) {
      const double z = boost::math::quantile(boost::math::normal(), (q + 0.5) / kQuantiles);
      const Index last = points[i].value.size() - 1;
      const double size = std::abs(points[i].value(last) + z * std::sqrt(points[i].variance(last)));
      times.emplace_back(std::max(0.0, points[i].warm_up_s / 3600 * std::log(size / band)), weights[i] / kQuantiles);
    }
  }
  std::sort(times.begin(), times.end());
  const auto at = [&](double share) {
    for (const auto& [time, weight] : times) {
      if ((share -= weight) <= 0) return time;
    }
    return HUGE_VAL;
  };
  const Estimate time{at(0.5), at(kOutside), at(1 - kOutside)};
  return time.high < longest_h ? std::optional(time) : std::nullopt;
}

}  // namespace

std::optional<DriftFit> fit_drift(const std::vector<DriftRecord>& records, double warm_up_band_deg_per_h) {
  std::size_t blocks = 0;
  double longest_s = 0, switched_on_s = 0, step_s = HUGE_VAL;
  for (const DriftRecord& record : records) {
    blocks += record.time_s.size();
    const double length_s = record.time_s.back() - record.time_s.front();
    longest_s = std::max(longest_s, length_s);
    if (record.switched_on) switched_on_s = std::max(switched_on_s, record.time_s.back());
    if (length_s > 0) step_s = std::min(step_s, length_s / static_cast<double>(record.time_s.size() - 1));
  }
  if (records.front().causes.empty() && switched_on_s == 0) return DriftFit{};
  if (blocks < kFewestBlocks + records.size()) return std::nullopt;
  const std::vector<Noise> noises = noise_grid(step_s, longest_s);
  std::vector<double> warm_up_s;
  for (double tau = 2 * step_s; tau < switched_on_s / 3; tau *= kTauRatio) warm_up_s.push_back(tau);
  std::vector<Point> points = fits(records, noises, warm_up_s);
  if (!warm_up_s.empty() && !points.empty()) points = refined(records, noises, points);
  if (points.empty()) return std::nullopt;

  const std::vector<double> weights = weights_of(points);
  DriftFit fit;
  for (Index c = 0; c < static_cast<Index>(records.front().causes.size()); ++c) {
    double mean = 0, square = 0;
    for (std::size_t i = 0; i < points.size(); ++i) mean += weights[i] * points[i].value(c);
    for (std::size_t i = 0; i < points.size(); ++i)
      square += weights[i] * (points[i].variance(c) + std::pow(points[i].value(c) - mean, 2));
    fit.causes.push_back({mean, mean - 1.96 * std::sqrt(square), mean + 1.96 * std::sqrt(square)});
  }
  fit.warm_up_h = warm_up_of(points, weights, warm_up_band_deg_per_h, switched_on_s / 3600);
  return fit;
}

Estimate mean_with_interval(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  const SummaryStatistics summary = summarise(values, Divisor::kNMinus1).value();
  const double far = boost::math::quantile(boost::math::students_t(n - 1), 1 - kOutside) * summary.sd / std::sqrt(n);
  return {summary.mean, summary.mean - far, summary.mean + far};
}

Estimate scatter_with_interval(std::span<const double> values) {
  const double sd = summarise(values, Divisor::kNMinus1).value().sd, freedom = static_cast<double>(values.size()) - 1;
  const boost::math::chi_squared square(freedom);
  const auto end = [&](double share) { return sd * std::sqrt(freedom / boost::math::quantile(square, share)); };
  return {sd, end(1 - kOutside), end(kOutside)};
}

}  // namespace prism::evaluation
