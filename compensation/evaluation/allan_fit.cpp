// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace prism::evaluation {
namespace {

using Eigen::Index;
using Strengths = Eigen::Vector4d;
using Columns = Eigen::Matrix<double, Eigen::Dynamic, 4>;  // one row per octave, one column per noise

constexpr Index kQ = 0, kN = 1, kB = 2, kK = 3;
constexpr double kGivenSigma = 3, kGivenShare = 0.3, kAtMost = 1.645, kRampSigma = 3;

Strengths unit_variances(double m) { return {3 / (m * m), 1 / m, 1, m / 3}; }

/// Degrees of freedom of each pure noise: NIST SP 1065, table 5. n values have n + 1 phases.
Strengths pure_edf(double n, double m) {
  const double p = n + 1;
  return {(p + 1) * (p - 2 * m) / (2 * (p - m)),
          (3 * (p - 1) / (2 * m) - 2 * (p - 2) / p) * 4 * m * m / (4 * m * m + 5),
          m == 1 ? 2 * (p - 2) * (p - 2) / (2.3 * p - 4.9) : 5 * p * p / (4 * m * (p + 3 * m)),
          (p - 2) / m * ((p - 1) * (p - 1) - 3 * m * (p - 1) + 4 * m * m) / ((p - 3) * (p - 3))};
}

/// Correlation of two points of a pure noise by their distance in octaves, from the exact covariances of 4 096 values
/// (Greenhall and Riley 2003).
double correlation(Index noise, std::size_t distance) {
  static const std::vector<double> kByDistance[] = {
      {1, 0.41, 0.5}, {1, 0.52, 0.19, 0.07, 0.02, 0}, {1, 0.68, 0.31, 0.12, 0.04, 0.015, 0}};  // the last: and further
  if (noise == kK) return distance == 0 ? 1 : 0.88 * std::pow(0.75, static_cast<double>(distance) - 1);
  return kByDistance[noise][std::min(distance, kByDistance[noise].size() - 1)];
}

/// Minimises |A x − y| with x >= 0: every set of the `free` columns (bits) is tried.
Strengths non_negative(const Columns& a, const Eigen::VectorXd& y, unsigned free) {
  const Eigen::Matrix4d gram = a.transpose() * a;
  const Strengths projected = a.transpose() * y;
  Strengths best = Strengths::Zero();
  double gain = 0;
  for (unsigned set = 1; set < 16; ++set) {
    if ((set & ~free) != 0) continue;
    std::vector<Index> columns;
    for (Index k = 0; k < 4; ++k) {
      if ((set >> k & 1) != 0) columns.push_back(k);
    }
    if (static_cast<Index>(columns.size()) > a.rows()) continue;
    const Eigen::VectorXd right = projected(columns);
    const Eigen::VectorXd x = gram(columns, columns).partialPivLu().solve(right);
    if (!x.allFinite() || x.minCoeff() < 0 || !(x.dot(right) > gain * (1 + 1e-12))) continue;
    gain = x.dot(right);
    best.setZero();
    best(columns) = x;
  }
  return best;
}

/// Variance of `slope` of AllanFit: (mean of the last third − mean of the first) / (2 n / 3).
double slope_variance(double n, const Strengths& noise) {
  const double third = n / 3, sign[] = {1, -1, -1, 1};
  double sum = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      const double t = third * std::abs(i - j), flicker = t > 0 ? t * t * std::log(t) / (4 * std::numbers::ln2) : 0;
      sum += sign[i] * sign[j] *
             (noise(kQ) * (t == 0) - noise(kN) * t / 2 + noise(kB) * flicker + noise(kK) * t * t * t / 12);
    }
  }
  return std::max(sum / (third * third), 0.0) / (4 * third * third);
}

/// The octaves' variances, raw or flat, divided by `scale`, and what they should be for given strengths.
class Curve {
 public:
  Curve(std::size_t n, const std::vector<AllanVariance>& octaves, double AllanVariance::*variance, double scale)
      : unit_(octaves.size(), 4), relative_(octaves.size(), 4), variances_(octaves.size()) {
    for (std::size_t i = 0; i < octaves.size(); ++i) {
      const double m = static_cast<double>(octaves[i].m);
      unit_.row(static_cast<Index>(i)) = unit_variances(m);
      relative_.row(static_cast<Index>(i)) =
          (2 / octaves[i].share / pure_edf(static_cast<double>(n), m).array()).sqrt().matrix();
      // A variance of 0 is a rate of few different values.
      variances_(static_cast<Index>(i)) = std::max(octaves[i].*variance / scale, 1e-15);
    }
    for (Index k = 0; k < 4; ++k) {
      rho_[k] = Eigen::MatrixXd::NullaryExpr(unit_.rows(), unit_.rows(), [&](Index i, Index j) {
        return correlation(k, static_cast<std::size_t>(std::lround(std::abs(std::log2(unit_(i, kN) / unit_(j, kN))))));
      });
    }
  }

  bool positive(const Strengths& noise) const { return ((unit_ * noise).array() > 0).all(); }

  /// The largest part of a noise in the variance of an octave.
  double share(Index k, const Strengths& noise) const {
    return (unit_.col(k) * noise(k)).cwiseQuotient(unit_ * noise).maxCoeff();
  }

  struct Linear {
    Eigen::VectorXd misses;    ///< distances of the points from the strengths, in standard deviations of each point
    Columns columns;           ///< whitened derivatives of `misses`
    Eigen::VectorXd residual;  ///< `misses`, whitened
  };

  Linear linear(const Strengths& noise) const {
    const Columns parts = (unit_ * noise.asDiagonal()).cwiseProduct(relative_);
    const Eigen::VectorXd sum = parts.rowwise().sum();
    Eigen::MatrixXd covariance = 1e-9 * Eigen::MatrixXd::Identity(sum.size(), sum.size());
    for (Index k = 0; k < 4; ++k) {
      const Eigen::VectorXd root = parts.col(k).cwiseQuotient(sum).cwiseSqrt();
      covariance += (root * root.transpose()).cwiseProduct(rho_[k]);
    }
    Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    // The rounded correlations of a random walk are not those of any noise from nine octaves on.
    if (factor.info() != Eigen::Success || factor.matrixLLT().diagonal().minCoeff() < 0.01)
      factor.compute(covariance + 0.01 * Eigen::MatrixXd::Identity(sum.size(), sum.size()));
    // The mean of the cube root of a chi-square with 2 / sd² degrees of freedom, relative: 1 − sd² / 9.
    const Eigen::ArrayXd expected = unit_ * noise, sd = sum.array() / expected;
    const Eigen::VectorXd misses = ((variances_.array() / expected).pow(1.0 / 3) - 1 + sd.square() / 9) * 3 / sd;
    return {misses, factor.matrixL().solve(sum.cwiseInverse().asDiagonal() * unit_), factor.matrixL().solve(misses)};
  }

  /// The most likely strengths, or those if the strength of one noise k >= 0 is `value`.
  Strengths fit(Index k = -1, double value = 0, const Strengths* start = nullptr) const {
    const unsigned free = k < 0 ? 15 : 15 & ~(1u << k);
    const Eigen::VectorXd weight = relative_.col(kN).cwiseInverse();
    Strengths noise =
        start != nullptr ? *start : non_negative(weight.cwiseQuotient(variances_).asDiagonal() * unit_, weight, free);
    if (k >= 0) noise(k) = value;
    for (int i = 0; i < 25; ++i) {
      const Linear at = linear(noise);
      Strengths next = noise;
      if (k >= 0) next(k) = 0;
      next = non_negative(at.columns, at.columns * next + at.residual, free);
      if (k >= 0) next(k) = value;
      if (i > 1) next = (next + noise) / 2;  // else it may alternate
      const bool done = ((next - noise).array().abs() <= 1e-3 * noise.array() + 1e-5 * noise.maxCoeff()).all();
      noise = next;
      if (!positive(noise)) noise(k == kQ ? kN : kQ) += 1e-12;
      if (done) break;
    }
    return noise;
  }

  /// A nearly standard normal number if strength k is `value`; positive if the points want more.
  double score(Index k, double value, const Strengths* start = nullptr) const {
    const Strengths noise = fit(k, value, start);
    if (!positive(noise)) return 0;
    const Linear at = linear(noise);
    const Eigen::VectorXd own = beside_others(at, k, noise);
    // Nothing is left if the other noises reproduce the column: too few points.
    return own.squaredNorm() > 1e-20 * at.columns.col(k).squaredNorm() ? own.dot(at.residual) / own.norm() : 0;
  }

  /// The strength at which score() is z, within half a per cent. `best`: the fit.
  double end(Index k, double z, const Strengths& best) const {
    const bool up = z < 0;
    const double sd = standard_deviation(k, best), step = up ? 1.6 : 1 / 1.6;
    double near = best(k) > 0 ? best(k) : sd * 1e-3, far = std::max(best(k), sd) * (up ? 1.5 : 1 / 1.5);
    const auto passed = [&](double value) { return (score(k, value, &best) < z) == up; };
    for (int i = 0; i < 12 && !passed(far); ++i) {
      near = far;
      far *= step;
    }
    for (int i = 0; i < 6; ++i) {
      const double middle = std::sqrt(near * far);
      (passed(middle) ? far : near) = middle;
    }
    return std::sqrt(near * far);
  }

 private:
  /// Of the fit of strength k; finite also if the points do not determine it.
  double standard_deviation(Index k, const Strengths& noise) const {
    Columns used = linear(noise).columns;
    for (Index j = 0; j < 4; ++j) {
      if (j != k && !(noise(j) > 0)) used.col(j).setZero();
    }
    const Eigen::Matrix4d information = used.transpose() * used;
    return std::sqrt(information.completeOrthogonalDecomposition().pseudoInverse()(k, k));
  }

  /// Column k without what the columns of the other noises explain.
  static Eigen::VectorXd beside_others(const Linear& at, Index k, const Strengths& noise) {
    std::vector<Index> others;
    for (Index j = 0; j < 4; ++j) {
      if (j != k && noise(j) > 0) others.push_back(j);
    }
    const Eigen::VectorXd own = at.columns.col(k);
    if (others.empty()) return own;
    const Eigen::MatrixXd known = at.columns(Eigen::all, others);
    return own - known * known.colPivHouseholderQr().solve(own);
  }

  Columns unit_;      // variance of each octave for a strength of 1
  Columns relative_;  // relative sd of that variance
  std::array<Eigen::MatrixXd, 4> rho_;
  Eigen::VectorXd variances_;
};

}  // namespace

AllanFit fit_allan(std::size_t n, double slope, const std::vector<AllanVariance>& octaves) {
  double scale = 0;  // the fit is in units of the largest variance
  for (const AllanVariance& each : octaves) scale = std::max(scale, each.flat);
  const Curve flat(n, octaves, &AllanVariance::flat, scale), raw(n, octaves, &AllanVariance::raw, scale);
  Strengths best = flat.fit(), wide = best;
  wide(kK) = flat.end(kK, -kAtMost, best);
  const double sd = std::sqrt(scale * slope_variance(static_cast<double>(n), best)),
               most = std::sqrt(scale * slope_variance(static_cast<double>(n), wide)), steep = std::abs(slope);
  const bool ramp = steep > kRampSigma * most, doubtful = !ramp && steep > kRampSigma * sd;
  const Curve& curve = ramp ? flat : raw;
  if (!ramp) best = raw.fit();
  AllanFit result;
  for (Index k = 0; k < 4; ++k) {
    const bool given =
        best(k) > 0 && curve.share(k, best) >= kGivenShare && !(k == kK && doubtful) && curve.score(k, 0) > kGivenSigma;
    AllanCoefficient& found = result.strengths[static_cast<std::size_t>(k)];
    if (given) found = {best(k) * scale, curve.end(k, 1, best) * scale, 0};
    found.high = curve.end(k, given ? -1 : -kAtMost, best) * scale;
    result.noise[static_cast<std::size_t>(k)] = best(k) * scale;
  }
  result.strengths[4] = ramp ? AllanCoefficient{steep, std::max(steep - sd, 0.0), steep + sd}
                             : AllanCoefficient{std::nullopt, 0, steep + kAtMost * most};
  const Eigen::VectorXd misses = curve.linear(best).misses;
  result.misses.assign(misses.begin(), misses.end());
  return result;
}

double allan_edf(std::size_t n, std::size_t m, const NoiseStrengths& noise) {
  const Strengths parts =
      unit_variances(static_cast<double>(m)).cwiseProduct(Strengths(noise[0], noise[1], noise[2], noise[3]));
  const double sd =
      (parts.array() * pure_edf(static_cast<double>(n), static_cast<double>(m)).array().rsqrt()).sum() / parts.sum();
  return 1 / (sd * sd);
}

}  // namespace prism::evaluation
