// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_model.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace prism::evaluation {
namespace {

constexpr auto kCount = static_cast<Eigen::Index>(kNoiseTypes);
constexpr unsigned kAll = (1U << kNoiseTypes) - 1;

/// Least squares |target − design · x|² with x >= 0 and x = 0 outside `free`, from the normal equations. With five
/// columns all 31 subsets can be tried: the solution is the best feasible one, without an iteration that could stall.
NoiseSquares non_negative_solution(const NoiseMatrix& normal, const NoiseSquares& right, unsigned free) {
  NoiseSquares best = NoiseSquares::Zero();
  double best_gain = 0;
  for (unsigned support = 1; support <= kAll; ++support) {
    if ((support & ~free) != 0) continue;
    std::array<Eigen::Index, kNoiseTypes> columns{};
    Eigen::Index count = 0;
    for (Eigen::Index k = 0; k < kCount; ++k) {
      if (support >> k & 1U) columns[static_cast<std::size_t>(count++)] = k;
    }
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kNoiseTypes, kNoiseTypes> part(count, count);
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kNoiseTypes, 1> side(count), scale(count);
    for (Eigen::Index a = 0; a < count; ++a)
      scale(a) = 1 / std::sqrt(normal(columns[static_cast<std::size_t>(a)], columns[static_cast<std::size_t>(a)]));
    for (Eigen::Index a = 0; a < count; ++a) {
      side(a) = right(columns[static_cast<std::size_t>(a)]) * scale(a);
      for (Eigen::Index b = 0; b < count; ++b)
        part(a, b) =
            normal(columns[static_cast<std::size_t>(a)], columns[static_cast<std::size_t>(b)]) * scale(a) * scale(b);
    }
    const auto factor = part.ldlt();
    const decltype(side) solved = factor.solve(side);
    if (!solved.allFinite() || solved.minCoeff() < 0) continue;
    const double gain = solved.dot(side);
    if (gain <= best_gain) continue;
    best_gain = gain;
    best.setZero();
    for (Eigen::Index a = 0; a < count; ++a) best(columns[static_cast<std::size_t>(a)]) = solved(a) * scale(a);
  }
  return best;
}

constexpr auto kRamp = static_cast<Eigen::Index>(NoiseType::kRateRamp);
constexpr NoiseType kWalk = NoiseType::kRateRandomWalk;
constexpr double kCertain = 4.5;                                 ///< standard deviations of a ramp that is certain
constexpr unsigned kRandom = kAll & ~(1U << (kNoiseTypes - 1));  // all but the ramp

}  // namespace

/// Mean and covariance of the cube roots for given strengths.
struct AllanModel::State {
  Eigen::VectorXd variance;  ///< expected Allan variances
  Eigen::VectorXd mean;      ///< of the cube roots
  Eigen::MatrixXd factor;    ///< lower Cholesky factor of their covariance
  Eigen::MatrixXd whitened(const Eigen::MatrixXd& m) const { return factor.triangularView<Eigen::Lower>().solve(m); }
};

AllanModel::Data AllanModel::as_measured(const AllanCurve& curve, const CurveCovariance& covariance) {
  const std::size_t points = curve.points.size();
  Data data{Eigen::VectorXd(points), Eigen::MatrixXd(points, kCount), {}};
  for (std::size_t i = 0; i < points; ++i) {
    const AllanPoint& point = curve.points[i];
    const auto row = static_cast<Eigen::Index>(i);
    data.cube_roots(row) = std::cbrt(point.deviation * point.deviation);
    data.design.row(row) = expected_variances(point).transpose();
    for (std::size_t j = i; j < points; ++j) data.covariance.push_back(covariance(i, j));
  }
  return data;
}

AllanModel::Data AllanModel::centred(const AllanCurve& curve, const CurveCovariance& covariance,
                                     const Data& as_measured) {
  const std::size_t points = curve.points.size();
  Data data{Eigen::VectorXd(points), as_measured.design, {}};
  std::size_t at = 0;
  for (std::size_t i = 0; i < points; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    data.cube_roots(row) = std::cbrt(curve.points[i].centred_variance);
    // A ramp of 1 adds m⁴ / m² times the variance of the mean difference to the covariance of the point: column R.
    const double size = static_cast<double>(curve.points[i].m);
    data.design.row(row) -= as_measured.covariance[at].col(kRamp).transpose() / (size * size);
    data.design(row, kRamp) = 0;
    at += points - i;
    for (std::size_t j = i; j < points; ++j) {
      data.covariance.push_back(covariance.centred(i, j));
      data.covariance.back().row(kRamp).setZero();
      data.covariance.back().col(kRamp).setZero();
    }
  }
  return data;
}

Result<AllanModel> AllanModel::fit(const AllanCurve& curve, const std::string& where) {
  if (curve.points.empty() || curve.estimator != AllanEstimator::kOverlapping)
    return make_error(where, "found no point of an overlapping Allan deviation, expected one or more");
  for (const AllanPoint& point : curve.points) {
    if (!(point.deviation > 0)) return make_error(where, "found an Allan deviation of 0, expected a rate that varies");
  }
  return AllanModel(curve);
}

AllanModel::AllanModel(const AllanCurve& curve) {
  const CurveCovariance covariance(curve);
  Data as_measured = AllanModel::as_measured(curve, covariance);
  data_ = centred(curve, covariance, as_measured);
  slope_ = curve.points.back().slope_per_sample;
  // Without the mean difference, relative to the points as they are; the cube root of the variance.
  const Eigen::ArrayXd left = data_.cube_roots.array() / as_measured.cube_roots.array();
  constexpr double kRounding = 1e-4;
  if (left.maxCoeff() <= kRounding) {  // a ramp without noise
    printed_(kRamp) = around_ramp_(kRamp) = slope_ * slope_;
    ramp_is_probable_ = ramp_is_certain_ = true;
    return;
  }
  const bool ramp = data_.cube_roots.minCoeff() > 0 && find_ramp(curve, as_measured);
  if (ramp) {
    printed_ = best_;
    printed_(kRamp) = slope_ * slope_;
    printed_misfit_ = misfit_;
  }
  if (!ramp_is_probable_) {
    data_ = std::move(as_measured);
    find_best();
  }
  if (ramp) return;
  printed_ = best_;
  printed_misfit_ = misfit_;
}

bool AllanModel::find_ramp(const AllanCurve& curve, const Data& as_measured) {
  find_best();
  const double size = static_cast<double>(curve.points.back().m);
  const NoiseSquares of_mean = as_measured.covariance.back().col(kRamp);
  const auto sd = [&](const NoiseSquares& squares) { return std::sqrt(2 * of_mean.dot(squares)) / (size * size); };
  slope_sd_ = sd(best_);
  if (std::abs(slope_) < 2 * slope_sd_) return false;
  around_ramp_ = shrunk();
  slope_sd_ = sd(around_ramp_);
  around_ramp_(kRamp) = slope_ * slope_;
  const double largest = strength_at(kWalk, -1);
  ramp_is_probable_ = std::abs(slope_) >= 3 * sd(fit_with(kWalk, largest));
  ramp_is_certain_ =
      ramp_is_probable_ && ramp_evidence(largest, of_mean * 2 / std::pow(size, 4)) >= kCertain * kCertain;
  return true;
}

double AllanModel::ramp_evidence(double typical_walk, const NoiseSquares& slope_variance) const {
  double with_ramp = std::numeric_limits<double>::infinity(), without = with_ramp;
  const auto add = [&](double walk) {
    const Linear at = linear(fit_with(kWalk, walk));
    const double variance = slope_variance.dot(at.strengths);
    const double points = at.residual.squaredNorm() + 2 * at.factor.diagonal().array().log().sum() + std::log(variance);
    with_ramp = std::min(with_ramp, points);
    const double none = points + slope_ * slope_ / variance;
    without = std::min(without, none);
    return none;
  };
  add(0);
  add(best_(static_cast<Eigen::Index>(kWalk)));
  for (double walk = typical_walk / 16; walk < typical_walk * 1e6; walk *= std::numbers::sqrt2) {
    if (add(walk) > without + 10 && walk > typical_walk) break;
  }
  return without - with_ramp;
}

/// Chance alone makes B or K positive in most records without them, and so the uncertainty of a ramp too large. They
/// count as far as the fit without both is worse than chance (as the estimate of James and Stein 1961).
NoiseSquares AllanModel::shrunk() const {
  constexpr unsigned kFast =
      1U << static_cast<unsigned>(NoiseType::kQuantisation) | 1U << static_cast<unsigned>(NoiseType::kAngleRandomWalk);
  const NoiseSquares fewer = solve(start(kFast), kFast);
  const State at = state(fewer);
  const double worse = at.whitened(data_.cube_roots - at.mean).squaredNorm() - cost(at, best_);
  const double kept = worse > 2 ? 1 - 2 / worse : 0;
  return kept * best_ + (1 - kept) * fewer;
}

AllanModel::State AllanModel::state(const NoiseSquares& squares) const {
  const Eigen::Index points = data_.cube_roots.size();
  State state;
  state.variance = data_.design.leftCols(kRamp) * squares.head(kRamp);
  Eigen::MatrixXd s(points, points);
  NoiseSquares random = squares;
  random(kRamp) = 0;
  std::size_t at = 0;
  for (Eigen::Index i = 0; i < points; ++i) {
    for (Eigen::Index j = i; j < points; ++j)
      s(j, i) = random.dot(data_.covariance[at++] * random) / (state.variance(i) * state.variance(j));
  }
  // The mean of the cube root is below the cube root of the mean by 2 / (9 edf) = s / 9.
  const Eigen::VectorXd roots = state.variance.array().pow(1.0 / 3);
  state.mean = roots.array() * (1 - s.diagonal().array() / 9);
  s.diagonal().array() += misfit_ * misfit_ + 1e-12;
  for (Eigen::Index i = 0; i < points; ++i) {
    for (Eigen::Index j = i; j < points; ++j) s(j, i) *= roots(i) * roots(j) / 9;
  }
  state.factor = s.llt().matrixL();
  return state;
}

Eigen::MatrixXd AllanModel::jacobian(const State& at) const {
  return (at.mean.array() / (3 * at.variance.array())).matrix().asDiagonal() * data_.design;
}

NoiseSquares AllanModel::solve(NoiseSquares squares, unsigned free, const std::optional<Fixed>& fixed) const {
  NoiseSquares given = squares;
  given(kRamp) = 0;
  for (Eigen::Index k = 0; k < kCount; ++k) {
    if (free >> k & 1U) given(k) = 0;
  }
  const double ramp = squares(kRamp);
  for (int pass = 0; pass < 30; ++pass) {
    const State at = state(squares);
    // u ≈ mean + J (x − x0), and J x0 = mean / 3.
    const Eigen::MatrixXd jacobian = this->jacobian(at);
    const Eigen::MatrixXd j = at.whitened(jacobian);
    const Eigen::VectorXd target = at.whitened(data_.cube_roots - at.mean * (2.0 / 3) - jacobian * given);
    NoiseMatrix normal = j.transpose() * j;
    NoiseSquares right = j.transpose() * target;
    if (fixed) {
      constexpr double kRelativeSd = 1e-6;
      const NoiseSquares row = fixed->row / (fixed->value * kRelativeSd);
      normal += row * row.transpose();
      right += row / kRelativeSd;
    }
    NoiseSquares next = given + non_negative_solution(normal, right, free);
    next(kRamp) = ramp;
    if (!((data_.design.leftCols(kRamp) * next.head(kRamp)).minCoeff() > 0)) break;
    if (pass >= 10) next = 0.5 * (squares + next);  // damps a cycle between two supports
    const double change =
        ((data_.design.leftCols(kRamp) * (next - squares).head(kRamp)).array() / at.variance.array()).abs().maxCoeff();
    squares = next;
    if (change < 1e-7) break;
  }
  return squares;
}

NoiseSquares AllanModel::start(unsigned free) const {
  NoiseSquares from = NoiseSquares::Zero();
  for (Eigen::Index k = 0; k < kRamp; ++k) {
    if (free >> k & 1U) from(k) = (data_.cube_roots.array().cube() / data_.design.col(k).array()).minCoeff() / 2;
  }
  return from;
}

NoiseSquares AllanModel::fit_with(NoiseType noise, double strength) const {
  const auto at = static_cast<Eigen::Index>(noise);
  const unsigned free = kRandom & ~(1U << at);
  NoiseSquares from = strength > 0 ? best_ : start(free);
  from(at) = strength;
  return solve(from, free);
}

AllanModel::Linear AllanModel::linear(const NoiseSquares& strengths) const {
  return linear(strengths, data_.cube_roots);
}

AllanModel::Linear AllanModel::linear(const NoiseSquares& strengths, const Eigen::VectorXd& cube_roots) const {
  State at = state(strengths);
  Linear result{strengths, jacobian(at), at.whitened(cube_roots - at.mean), {}, {}};
  result.jacobian = at.whitened(result.jacobian);
  result.mean = std::move(at.mean);
  result.factor = std::move(at.factor);
  return result;
}

NoiseSquares AllanModel::noise_through(const AllanPoint& point, double variance) const {
  if (ramp_is_probable_) return around_ramp_;
  return solve(best_, kRandom, Fixed{expected_variances(point), variance});
}

double AllanModel::cost(const State& at, const NoiseSquares& squares) const {
  return at.whitened(data_.cube_roots - state(squares).mean).squaredNorm();
}

double AllanModel::distance(NoiseType noise, double strength) const {
  const NoiseSquares restricted = fit_with(noise, strength);
  const State at = state(restricted);
  const double worse = at.whitened(data_.cube_roots - at.mean).squaredNorm();
  const double root = std::sqrt(std::max(0.0, worse - cost(at, best_)));
  return strength < best_(static_cast<Eigen::Index>(noise)) ? root : -root;
}

double AllanModel::strength_at(NoiseType noise, double distance) const {
  const double best = best_(static_cast<Eigen::Index>(noise));
  double low = 0, high = best;
  if (distance > 0) {
    if (!(best > 0) || this->distance(noise, 0) < distance) return 0;
  } else {
    // The largest strength that no point contradicts.
    const auto column = data_.design.col(static_cast<Eigen::Index>(noise)).array();
    high = std::max(best, 1e-3 * (data_.cube_roots.array().cube() / column).minCoeff());
    for (int step = 0; step < 60 && this->distance(noise, high) > distance; ++step) low = std::exchange(high, 2 * high);
  }
  for (int step = 0; step < 40 && high - low > 1e-4 * high; ++step) {
    const double middle = low > 0.1 * high ? 0.5 * (low + high) : std::max(low, 0.2 * high);
    (this->distance(noise, middle) > distance ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

void AllanModel::find_best() {
  misfit_ = 0;
  best_ = solve(start(kRandom), kRandom);
  const auto chance = [&] {
    const State at = state(best_);
    return at.whitened(data_.cube_roots - at.mean).squaredNorm();
  };
  const Eigen::Index left = data_.cube_roots.size() - (best_.array() > 0).count();
  if (left < 1) return;
  const boost::math::chi_squared distribution(static_cast<double>(left));
  if (chance() < boost::math::quantile(distribution, 0.999)) return;
  double low = 0, high = 10;
  for (int step = 0; step < 40 && !(low > 0 && high / low < 1.05); ++step) {
    misfit_ = low > 0 ? std::sqrt(low * high) : high / 3;
    best_ = solve(start(kRandom), kRandom);
    if (chance() <= static_cast<double>(left)) {
      high = misfit_;
    } else {
      low = misfit_;
    }
  }
}

}  // namespace prism::evaluation
