// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_covariance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace prism::evaluation {
namespace {

constexpr auto kQ = static_cast<Eigen::Index>(NoiseType::kQuantisation);
constexpr auto kN = static_cast<Eigen::Index>(NoiseType::kAngleRandomWalk);
constexpr auto kB = static_cast<Eigen::Index>(NoiseType::kBiasInstability);
constexpr auto kK = static_cast<Eigen::Index>(NoiseType::kRateRandomWalk);
constexpr auto kR = static_cast<Eigen::Index>(NoiseType::kRateRamp);
constexpr double kFlickerScale = 1 / (4 * std::numbers::ln2);

/// (1, −2, 1) · R(t − m, t, t + m).
template <class Function>
double second_difference(Function&& r, double t, double m) {
  return r(t + m) - 2 * r(t) + r(t - m);
}

double flicker(double t) {
  const double size = std::abs(t);
  return size > 0 ? kFlickerScale * t * t * std::log(size) : 0;
}

/// Far from the origin the difference cancels; the second derivative is exact to (m / t)² / 6 there.
double flicker_difference(double t, double m) {
  if (std::abs(t) > 64 * m) return m * m * kFlickerScale * (2 * std::log(std::abs(t)) + 3);
  return second_difference(flicker, t, m);
}

/// Covariance of two second differences of the phase whose centres are t samples apart, without Q.
struct Shape {
  double m1, m2;  // m1 <= m2

  NoiseSquares at(double t) const {
    NoiseSquares c = NoiseSquares::Zero();
    const double size = std::abs(t);
    if (size < m1 + m2) {
      const auto white = [](double x) { return -0.5 * std::abs(x); };
      const auto walk = [](double x) { return std::abs(x * x * x) / 12; };
      c(kN) = second_difference([&](double x) { return second_difference(white, x, m1); }, t, m2);
      c(kK) = second_difference([&](double x) { return second_difference(walk, x, m1); }, t, m2);
    }
    c(kB) = size > 64 * m2 ? -2 * kFlickerScale * m1 * m1 * m2 * m2 / (t * t)
                           : second_difference([&](double x) { return flicker_difference(x, m1); }, t, m2);
    return c;
  }

  /// White phase noise is correlated only where the differences share a phase.
  double quantisation_at(double t) const {
    double sum = 0;
    for (const int a : {-1, 0, 1}) {
      for (const int b : {-1, 0, 1}) {
        if (t + b * m2 == a * m1) sum += (a == 0 ? -2 : 1) * (b == 0 ? -2 : 1);
      }
    }
    return sum;
  }

  /// Adds `weight` pairs of differences at distance t, without Q: 2 C² + 4 c1 c2 C, c the constant of a ramp.
  void add(NoiseMatrix& sum, double t, double weight) const {
    const NoiseSquares c = at(t);
    sum.noalias() += 2 * weight * c * c.transpose();
    const NoiseSquares ramp = 2 * weight * m1 * m1 * m2 * m2 * c;
    sum.row(kR) += ramp.transpose();
    sum.col(kR) += ramp;
  }

  /// Adds the part of Q at distance t.
  void add_quantisation(NoiseMatrix& sum, double t, double weight) const {
    const double q = quantisation_at(t);
    NoiseSquares cross = 2 * weight * q * at(t);
    cross(kR) = 2 * weight * m1 * m1 * m2 * m2 * q;
    sum.row(kQ) += cross.transpose();
    sum.col(kQ) += cross;
    sum(kQ, kQ) += 2 * weight * q * q;
  }
};

/// Nodes and weights of Gauss and Legendre on [−1, 1], six points; positive half.
constexpr std::array<std::pair<double, double>, 3> kLegendre = {{{0.2386191860831969, 0.4679139345726910},
                                                                 {0.6612093864662645, 0.3607615730481386},
                                                                 {0.9324695142031521, 0.1713244923791704}}};

/// Sums f over the integers of [begin, end): term by term if there are few, else as an integral of a smooth function.
template <class Function>
void sum_panel(Function&& f, double begin, double end) {
  if (end - begin <= 16) {
    for (double t = begin; t < end; ++t) f(t, 1.0);
    return;
  }
  const double middle = 0.5 * (begin + end) - 0.5, half = 0.5 * (end - begin);
  for (const auto& [node, weight] : kLegendre) {
    f(middle - half * node, half * weight);
    f(middle + half * node, half * weight);
  }
}

/// The same between two kinks of f: the panels grow with the distance from the kinks, from `finest` on.
template <class Function>
void sum_between(Function&& f, double begin, double end, double finest) {
  double low = begin, high = end;
  for (double size = finest; high - low > 2 * size; size *= 2) {
    sum_panel(f, low, low + size);
    sum_panel(f, high - size, high);
    low += size;
    high -= size;
  }
  const double middle = std::floor(0.5 * (low + high));
  sum_panel(f, low, middle);
  sum_panel(f, middle, high);
}

}  // namespace

const char* noise_type_text(NoiseType type) {
  switch (type) {
    case NoiseType::kQuantisation:
      return "quantisation";
    case NoiseType::kAngleRandomWalk:
      return "angle random walk";
    case NoiseType::kBiasInstability:
      return "bias instability";
    case NoiseType::kRateRandomWalk:
      return "rate random walk";
    case NoiseType::kRateRamp:
      return "rate ramp";
  }
  return "";
}

NoiseSquares unit_variances(double m) {
  NoiseSquares unit;
  unit << 3 / (m * m), 1 / m, 1, m / 3, m * m / 2;
  return unit;
}

namespace {

/// The strength of N that looks like the angle errors at gaps, for a strength of Q of 1.
double as_white(const AllanPoint& point) {
  return 3 * std::max(0.0, point.quantisation - 1) / static_cast<double>(point.m);
}

/// Standard deviation of the variance that these errors add, beyond that of this N. All points have the same gaps.
double gap_deviation(const AllanPoint& point) {
  const double size = static_cast<double>(point.m);
  return 3 * point.gap_deviation / (size * size);
}

}  // namespace

NoiseMatrix shown_noise(const AllanPoint& a, const AllanPoint& b) {
  NoiseMatrix shown = NoiseMatrix::Identity();
  shown(kQ, kQ) = std::sqrt(std::min(1.0, a.quantisation) * std::min(1.0, b.quantisation));
  shown(kN, kQ) = std::min(as_white(a), as_white(b));
  shown(kB, kB) = shown(kK, kK) = std::sqrt(a.slow * b.slow);
  return shown;
}

NoiseMatrix shown_noise(const AllanPoint& point) { return shown_noise(point, point); }

NoiseSquares expected_variances(const AllanPoint& point) {
  return shown_noise(point).transpose() * unit_variances(static_cast<double>(point.m));
}

double own_share(const AllanPoint& point, const NoiseSquares& noise) {
  return unit_variances(static_cast<double>(point.m)).dot(noise) / expected_variances(point).dot(noise);
}

NoiseMatrix overlapping_covariance(std::size_t values, std::size_t m1, std::size_t m2) {
  const Shape shape{static_cast<double>(std::min(m1, m2)), static_cast<double>(std::max(m1, m2))};
  const double small = shape.m1, large = shape.m2, n = static_cast<double>(values);
  const double terms1 = n + 1 - 2 * small, terms2 = n + 1 - 2 * large;
  // Number of pairs at a distance of t: all terms of the larger clusters while both ends are inside.
  const auto pairs = [&](double t) { return std::max(0.0, terms2 - std::max(0.0, std::abs(t) - (large - small))); };
  const auto both_signs = [](double t) { return t == 0 ? 1.0 : 2.0; };
  NoiseMatrix sum = NoiseMatrix::Zero();
  const double last = terms2 + large - small;  // first distance without a pair
  std::vector<double> kinks = {0, 1, small, large - small, large, large + small, last};
  for (double& kink : kinks) kink = std::clamp(kink, 0.0, last);
  std::sort(kinks.begin(), kinks.end());
  for (std::size_t i = 0; i + 1 < kinks.size(); ++i) {
    if (kinks[i + 1] <= kinks[i]) continue;
    sum_between([&](double t, double weight) { shape.add(sum, t, weight * both_signs(t) * pairs(t)); }, kinks[i],
                kinks[i + 1], kinks[i] >= large + small ? large : small);
  }
  std::vector<double> shared = {0, small, large - small, large, large + small};
  std::sort(shared.begin(), shared.end());
  shared.erase(std::unique(shared.begin(), shared.end()), shared.end());
  for (const double t : shared) shape.add_quantisation(sum, t, both_signs(t) * pairs(t));
  return sum / (4 * small * small * large * large * terms1 * terms2);
}

NoiseMatrix centring_covariance(std::size_t values, std::size_t m1, std::size_t m2) {
  NoiseMatrix result = NoiseMatrix::Zero();
  const std::size_t small = std::min(m1, m2), large = std::max(m1, m2);
  if (values / small > 512) return result;
  // Eight samples per smaller cluster are enough: the noises scale with the cluster size.
  const std::size_t reduction = std::max<std::size_t>(1, small / 8);
  const auto n = static_cast<Eigen::Index>(values / reduction), a = static_cast<Eigen::Index>(small / reduction),
             b = static_cast<Eigen::Index>(large / reduction);
  const Shape shape{static_cast<double>(a), static_cast<double>(b)};
  // Sums of the covariance over the distances 0 to t − 1.
  Eigen::Matrix<double, kNoiseTypes, Eigen::Dynamic> up_to(kNoiseTypes, n + 2);
  up_to.col(0).setZero();
  for (Eigen::Index t = 0; t <= n; ++t) up_to.col(t + 1) = up_to.col(t) + shape.at(static_cast<double>(t));
  const auto sum_between_centres = [&](Eigen::Index from, Eigen::Index to) -> NoiseSquares {  // from <= 0 <= to, or not
    const auto signed_sum = [&](Eigen::Index t) -> NoiseSquares {  // over the distances below t, from 0
      return t >= 0 ? NoiseSquares(up_to.col(t)) : NoiseSquares(up_to.col(1) - up_to.col(1 - t));
    };
    return signed_sum(to + 1) - signed_sum(from);
  };
  const auto rows = [&](Eigen::Index own, Eigen::Index other, NoiseSquares& total) {
    NoiseMatrix squares = NoiseMatrix::Zero();
    for (Eigen::Index i = own; i <= n - own; ++i) {
      const NoiseSquares sum = sum_between_centres(other - i, n - other - i);
      squares.noalias() += sum * sum.transpose();
      total += sum;
    }
    return squares;
  };
  NoiseSquares total = NoiseSquares::Zero(), unused = NoiseSquares::Zero();
  const auto terms1 = static_cast<double>(n + 1 - 2 * a), terms2 = static_cast<double>(n + 1 - 2 * b);
  const NoiseMatrix first = rows(a, b, total), second = rows(b, a, unused);
  result = first / terms2 + second / terms1 - total * total.transpose() / (terms1 * terms2);
  result *= 2 / (4 * shape.m1 * shape.m1 * shape.m2 * shape.m2 * terms1 * terms2);
  NoiseSquares scale = NoiseSquares::Ones();
  scale(kN) = 1 / static_cast<double>(reduction);
  scale(kK) = static_cast<double>(reduction);
  return scale.asDiagonal() * result * scale.asDiagonal();
}

double skewness_degrees_of_freedom(std::size_t values, std::size_t m, const NoiseSquares& noise) {
  constexpr double kSamplesPerCluster = 8;  // enough: the noises scale with the cluster size
  const double size = std::min(static_cast<double>(m), kSamplesPerCluster);
  const auto terms =
      static_cast<Eigen::Index>(std::floor(static_cast<double>(values) / static_cast<double>(m) * size - 2 * size)) + 1;
  const Shape shape{size, size};
  const NoiseSquares parts = unit_variances(static_cast<double>(m)).cwiseProduct(noise);
  const auto covariance = [&](double t) -> NoiseSquares {
    NoiseSquares c = shape.at(t);
    c(kQ) = shape.quantisation_at(t);
    return c;
  };
  NoiseSquares scale = NoiseSquares::Zero();
  scale.head(kR) = parts.head(kR).cwiseQuotient(covariance(0).head(kR));
  Eigen::MatrixXd c(terms, terms);
  for (Eigen::Index lag = 0; lag < terms; ++lag) {
    const double value = scale.dot(covariance(static_cast<double>(lag)));
    c.diagonal(lag).setConstant(value);
    c.diagonal(-lag).setConstant(value);
  }
  const Eigen::MatrixXd square = c * c;
  const double second = square.trace(), third = square.cwiseProduct(c).sum();
  return second * second * second / (third * third);
}

NoiseMatrix adjacent_variance(std::size_t values, std::size_t m) {
  const std::size_t clusters = values / m;
  const double size = static_cast<double>(m), terms = static_cast<double>(clusters) - 1;
  const Shape shape{size, size};
  NoiseMatrix sum = NoiseMatrix::Zero();
  // Beyond some hundred clusters the covariance, at most of order 1 / distance², is negligible.
  for (double lag = 0; lag < std::min(terms, 512.0); ++lag) {
    const double weight = (lag == 0 ? 1 : 2) * (terms - lag);
    shape.add(sum, lag * size, weight);
    if (lag <= 2) shape.add_quantisation(sum, lag * size, weight);
  }
  return sum / (4 * size * size * size * size * terms * terms);
}

std::size_t allan_terms(AllanEstimator estimator, std::size_t values, std::size_t m) {
  if (values < 2 * m) return 0;
  return estimator == AllanEstimator::kOverlapping ? values - 2 * m + 1 : values / m - 1;
}

CurveCovariance::CurveCovariance(const AllanCurve& curve) : curve_(curve) {
  for (const std::size_t length : curve.records) ++records_[length];
  if (records_.size() <= 16) return;
  // Many sessions: lengths within 10 % of each other are treated as equal.
  std::map<std::size_t, std::size_t> rounded;
  for (const auto& [length, count] : records_) {
    const double step = std::round(std::log(static_cast<double>(length)) / 0.1);
    rounded[static_cast<std::size_t>(std::llround(std::exp(0.1 * step)))] += count;
  }
  records_ = std::move(rounded);
}

template <class Covariance>
NoiseMatrix CurveCovariance::pooled(std::size_t i, std::size_t j, Covariance&& of_record) const {
  const std::size_t m1 = curve_.points[i].m, m2 = curve_.points[j].m;
  NoiseMatrix sum = NoiseMatrix::Zero();
  double terms1 = 0, terms2 = 0;
  for (const auto& [values, count] : records_) {
    const auto t1 = static_cast<double>(allan_terms(curve_.estimator, values, m1));
    const auto t2 = static_cast<double>(allan_terms(curve_.estimator, values, m2));
    const auto records = static_cast<double>(count);
    terms1 += records * t1;
    terms2 += records * t2;
    if (t1 >= 1 && t2 >= 1) sum += records * t1 * t2 * of_record(values, m1, m2);
  }
  const double used1 = static_cast<double>(curve_.points[i].terms), used2 = static_cast<double>(curve_.points[j].terms);
  const NoiseMatrix shown = shown_noise(curve_.points[i], curve_.points[j]);
  NoiseMatrix covariance = shown.transpose() * sum * shown / std::sqrt(terms1 * terms2 * used1 * used2);
  covariance(kQ, kQ) += gap_deviation(curve_.points[i]) * gap_deviation(curve_.points[j]);
  return covariance;
}

NoiseMatrix CurveCovariance::operator()(std::size_t i, std::size_t j) const {
  return pooled(i, j, [&](std::size_t values, std::size_t m1, std::size_t m2) {
    return curve_.estimator == AllanEstimator::kOverlapping ? overlapping_covariance(values, m1, m2)
                                                            : adjacent_variance(values, m1);
  });
}

NoiseMatrix CurveCovariance::centred(std::size_t i, std::size_t j) const {
  return pooled(i, j, [](std::size_t values, std::size_t m1, std::size_t m2) -> NoiseMatrix {
    return overlapping_covariance(values, m1, m2) - centring_covariance(values, m1, m2);
  });
}

}  // namespace prism::evaluation
