// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_strength.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "compensation/evaluation/even_draws.hpp"

namespace prism::evaluation {
namespace {

constexpr Eigen::Index kOthers = 4;  ///< all noises but the ramp
using Vector = Eigen::Vector4d;
using Matrix = Eigen::Matrix4d;

/// In the test the other noises may be negative by this many of their standard deviations (each if the others are
/// known). Without a limit the distribution of the statistic would not depend on their strengths, which are not known.
/// With a narrow one it does (0.7: K = 0 of white noise held the truth in 73.6 % of 1 000 records, with 2 in 71),
/// but the interval is narrower (N of white noise: by 17 %).
constexpr double kSlack = 2;

double normal_quantile(double probability) { return boost::math::quantile(boost::math::normal(), probability); }
double normal_share(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// The quasi-likelihood near a fit, as a quadratic function of the change d of the four strengths, each in units of its
/// standard deviation if the others are known: −2 g'd + d'I d.
class Quadratic {
 public:
  Quadratic(const AllanModel::Linear& at, Eigen::Index tested, double slack) : tested_(tested) {
    Eigen::Matrix<double, Eigen::Dynamic, kOthers> j = at.jacobian.leftCols(kOthers);
    unit_ = j.colwise().norm().cwiseInverse().transpose();
    j = j * unit_.asDiagonal();
    information_ = j.transpose() * j;
    information_.diagonal() *= 1 + 1e-9;
    gradients_ = j.transpose();
    strengths_ = at.strengths.head(kOthers).cwiseQuotient(unit_);
    lower_ = -strengths_.array() - slack;
    for (unsigned free = 1U << kOthers; free-- > 0;) add(free);
  }

  Vector gradient(const Eigen::VectorXd& whitened) const { return gradients_ * whitened; }
  const Matrix& information() const { return information_; }
  const Vector& strengths() const { return strengths_; }
  const Vector& unit() const { return unit_; }

  /// Signed root of the gain from a change of the tested strength.
  double statistic(const Vector& gradient) const {
    Vector change, unused;
    const double gain = least(others_, gradient, unused) - least(all_, gradient, change);
    return std::copysign(std::sqrt(std::max(0.0, gain)), change(tested_));
  }

  /// The same if no strength had a limit: standard normal.
  double unlimited_statistic(const Vector& gradient) const {
    const Matrix& inverse = all_.front().matrix;  // all are free
    return inverse.row(tested_).dot(gradient) / std::sqrt(inverse(tested_, tested_));
  }

  /// The best change of the others.
  Vector best_change_of_others(const Vector& gradient) const {
    Vector change;
    least(others_, gradient, change);
    return change;
  }

 private:
  /// The minimum with some strengths at their lower limits: d = matrix · g + constant.
  struct Support {
    Matrix matrix;
    Vector constant;
    unsigned free;
  };

  void add(unsigned free) {
    Support support{Matrix::Zero(), Vector::Zero(), free};
    std::array<Eigen::Index, 4> index{};
    Eigen::Index count = 0;
    for (Eigen::Index k = 0; k < kOthers; ++k) {
      if (free >> k & 1U) {
        index[static_cast<std::size_t>(count++)] = k;
      } else if (k != tested_) {
        support.constant(k) = lower_(k);
      }
    }
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 4, 4> part(count, count);
    for (Eigen::Index a = 0; a < count; ++a) {
      for (Eigen::Index b = 0; b < count; ++b)
        part(a, b) = information_(index[static_cast<std::size_t>(a)], index[static_cast<std::size_t>(b)]);
    }
    if (count > 0) {
      const decltype(part) inverse = part.inverse();
      for (Eigen::Index a = 0; a < count; ++a) {
        for (Eigen::Index b = 0; b < count; ++b)
          support.matrix(index[static_cast<std::size_t>(a)], index[static_cast<std::size_t>(b)]) = inverse(a, b);
      }
    }
    support.constant -= support.matrix * (information_ * support.constant);
    (free >> tested_ & 1U ? all_ : others_).push_back(support);
  }

  double least(const std::vector<Support>& supports, const Vector& gradient, Vector& best) const {
    double least = std::numeric_limits<double>::infinity();
    for (const Support& support : supports) {
      const Vector change = support.matrix * gradient + support.constant;
      bool allowed = true;
      for (Eigen::Index k = 0; k < kOthers; ++k)
        allowed &= k == tested_ || !(support.free >> k & 1U) || change(k) >= lower_(k);
      if (!allowed) continue;
      const double value = change.dot(information_ * change) - 2 * gradient.dot(change);
      if (value >= least) continue;
      least = value;
      best = change;
      if (&support == &supports.front()) break;  // all are free: no other is better
    }
    return least;
  }

  Eigen::Index tested_;
  Matrix information_;
  Eigen::Matrix<double, kOthers, Eigen::Dynamic> gradients_;
  Vector unit_, strengths_, lower_;
  std::vector<Support> all_, others_;
};

/// Statistics of drawn curves, and the same without limits of the other noises, which are standard normal.
struct Drawn {
  std::vector<double> statistics, unlimited;

  /// The probability of a statistic below `t`. The difference of the two counts has a smaller error than a count.
  double share_below(double t) const {
    const auto below = [&](const std::vector<double>& values) {
      return static_cast<double>(std::count_if(values.begin(), values.end(), [&](double x) { return x < t; }));
    };
    const double n = static_cast<double>(statistics.size()), edge = 0.5 / n;
    return std::clamp(normal_share(t) + (below(statistics) - below(unlimited)) / n, edge, 1 - edge);
  }
};

/// The normal number with the same place among its kind as `observed` has among `drawn`; beyond the outer fortieth
/// both continue with the same slope.
double standardised(Drawn drawn, double observed) {
  const auto outer = static_cast<std::ptrdiff_t>(drawn.statistics.size()) / 40;
  const auto quantile = [&](std::ptrdiff_t place) {
    const auto at = drawn.statistics.begin() + place;
    std::nth_element(drawn.statistics.begin(), at, drawn.statistics.end());
    return *at;
  };
  const double low = quantile(outer), high = quantile(static_cast<std::ptrdiff_t>(drawn.statistics.size()) - 1 - outer);
  const double inside = std::clamp(observed, low, high);
  return normal_quantile(drawn.share_below(inside)) + observed - inside;
}

/// The accepted range of the estimate x of a mean, 0 or more, of a normal number of sd 1.
struct Accepted {
  double low, high;  ///< of x − mean
};

/// Feldman and Cousins: the x whose ratio of the likelihoods, of `mean` and of the best mean >= 0, is largest.
Accepted accepted(double mean, double probability) {
  const auto low_for = [&](double root) {
    if (mean >= root) return -root;
    return mean > 0 ? (mean * mean - root * root) / (2 * mean) - mean : -std::numeric_limits<double>::infinity();
  };
  double low = 0, high = normal_quantile(0.5 * (1 + probability));
  for (int step = 0; step < 50; ++step) {
    const double root = 0.5 * (low + high);
    (normal_share(root) - normal_share(low_for(root)) < probability ? low : high) = root;
  }
  return {low_for(high), high};
}

/// Tests strengths of one noise.
class StrengthTest {
 public:
  StrengthTest(const AllanModel& model, NoiseType noise, double probability)
      : model_(model), noise_(noise), tested_(static_cast<Eigen::Index>(noise)), probability_(probability) {}

  /// How far inside the accepted range the record is if this is the true strength: the distances from the ends at
  /// which the strength is too large, and too small. Negative if it is rejected.
  struct Margins {
    double too_large, too_small;
    double sd;  ///< of the strength, if the others are known
  };

  Margins operator()(double strength) {
    const AllanModel::Linear at = model_.linear(model_.fit_with(noise_, strength));
    const Quadratic quadratic(at, tested_, kSlack);
    const double observed = quadratic.statistic(quadratic.gradient(at.residual));
    const Matrix factor = quadratic.information().llt().matrixL();
    Drawn drawn;
    for (const Vector& draw : even_normal_draws()) {
      const Vector gradient = factor * draw;
      drawn.statistics.push_back(quadratic.statistic(gradient));
      drawn.unlimited.push_back(quadratic.unlimited_statistic(gradient));
    }
    double z = standardised(std::move(drawn), observed);
    const double from_0 = distance_from_0(at);
    const Accepted range = accepted(from_0, probability_);
    if (strength == 0 && std::abs(z - range.high) < 0.6) at_0_ = correction(at, quadratic, observed, z);
    z += at_0_ * std::max(0.0, 1 - from_0);
    return {std::min(z - range.low, 10.0), range.high - z, quadratic.unit()(tested_)};
  }

 private:
  /// The statistic that the expected points of this strength give in the test of 0.
  double distance_from_0(const AllanModel::Linear& at) const {
    if (!(at.strengths(tested_) > 0)) return 0;
    const Quadratic quadratic(at, tested_, 0);
    // Without the tested noise: a change of minus its strength, and the best change of the others.
    const Vector& strengths = quadratic.strengths();
    Vector without = Vector::Zero();
    without(tested_) = -strengths(tested_);
    const Vector change = without + quadratic.best_change_of_others(-(quadratic.information() * without));
    return std::sqrt(std::max(0.0, change.dot(quadratic.information() * change)));
  }

  /// Correction of z at a strength of 0. The weights follow from the fit, and so depend on the points; the linear model
  /// does not have this. Each drawn curve gets a fit of its own and is compared with the same draw of the linear model.
  double correction(const AllanModel::Linear& at, const Quadratic& quadratic, double observed, double z) const {
    constexpr int kCurves = 512;  // with 128 the same few draws shifted all intervals of B = 0 by up to 4 %
    const Quadratic strict(at, tested_, 0);
    const Eigen::Index points = at.mean.size();
    std::mt19937_64 engine(1);
    double fewer = 0;
    for (int curve = 0; curve < kCurves; ++curve) {
      Eigen::VectorXd noise(points);
      for (double& value : noise) value = normal_quantile((static_cast<double>(engine() >> 11) + 0.5) * 0x1p-53);
      for (const double sign : {1.0, -1.0}) {
        const Eigen::VectorXd drawn = sign * noise;
        fewer -= quadratic.statistic(quadratic.gradient(drawn)) < observed;
        fewer += refitted(at, strict, drawn) < observed;
      }
    }
    const double share = std::clamp(normal_share(z) + fewer / (2 * kCurves), 0.01, 0.99);
    return normal_quantile(share) - z;
  }

  /// The statistic of a drawn curve, with the fit of this curve.
  double refitted(const AllanModel::Linear& at, const Quadratic& strict, const Eigen::VectorXd& drawn) const {
    const Eigen::VectorXd roots = at.mean + at.factor.triangularView<Eigen::Lower>() * drawn;
    AllanModel::Linear own = moved(at, strict, strict.gradient(drawn), roots);
    const Quadratic near(own, tested_, 0);
    own = moved(own, near, near.gradient(own.residual), roots);
    const Quadratic quadratic(own, tested_, kSlack);
    return quadratic.statistic(quadratic.gradient(own.residual));
  }

  AllanModel::Linear moved(const AllanModel::Linear& at, const Quadratic& quadratic, const Vector& gradient,
                           const Eigen::VectorXd& roots) const {
    NoiseSquares strengths = at.strengths;
    const Vector next = (quadratic.strengths() + quadratic.best_change_of_others(gradient)).cwiseMax(0);
    strengths.head(kOthers) = next.cwiseProduct(quadratic.unit());
    if (!(strengths.head(kOthers).maxCoeff() > 0)) strengths = at.strengths;
    return model_.linear(strengths, roots);
  }

  const AllanModel& model_;
  NoiseType noise_;
  Eigen::Index tested_;
  double probability_;
  double at_0_ = 0;
};

struct Ordinate {
  double x, y;
};

/// The zero of f between two ordinates of different sign, within a five-hundredth of their distance; else the end that
/// is nearer to a zero.
template <class Function>
double root_between(Function&& f, const Ordinate& a, const Ordinate& b) {
  if (!(a.x < b.x) || (a.y > 0) == (b.y > 0)) return std::abs(a.y) < std::abs(b.y) ? a.x : b.x;
  std::uintmax_t steps = 12;
  const auto near = [&](double x, double y) { return std::abs(y - x) < 2e-3 * (b.x - a.x); };
  const auto [low, high] = boost::math::tools::toms748_solve(f, a.x, b.x, a.y, b.y, near, steps);
  return 0.5 * (low + high);
}

}  // namespace

StrengthInterval strength_interval(const AllanModel& model, NoiseType noise, double probability) {
  StrengthTest test(model, noise, probability);
  const double best = model.best()(static_cast<Eigen::Index>(noise));
  const StrengthTest::Margins at_0 = test(0), at_best = best > 0 ? test(best) : at_0;
  // Upwards until a strength is too large.
  double inside = best, inside_margin = at_best.too_large, outside = best + 1.5 * at_best.sd, outside_margin = 0;
  for (int step = 0; step < 60; ++step) {
    outside_margin = test(outside).too_large;
    if (outside_margin < 0) break;
    inside = std::exchange(outside, outside + std::max(outside, at_best.sd));
    inside_margin = outside_margin;
  }
  StrengthInterval interval;
  const auto too_large = [&](double strength) { return test(strength).too_large; };
  interval.high = root_between(too_large, {inside, inside_margin}, {outside, outside_margin});
  if (at_0.too_small < 0) {
    const auto too_small = [&](double strength) { return test(strength).too_small; };
    const bool below = best > 0 && at_best.too_small > 0;
    const Ordinate top = below ? Ordinate{best, at_best.too_small} : Ordinate{interval.high, too_small(interval.high)};
    interval.low = root_between(too_small, {0, at_0.too_small}, top);
  }
  return interval;
}

}  // namespace prism::evaluation
