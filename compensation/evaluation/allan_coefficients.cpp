// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_coefficients.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace prism::evaluation {
namespace {

enum Noise { kQ, kN, kB, kK, kR, kNoises };

/// Variance at tau for a coefficient of 1, (deg/h)².
std::array<double, kNoises> unit_variances(double tau_s) {
  const double tau_h = tau_s / 3600;
  return {3 / (tau_s * tau_s), 1 / tau_h, kAllanFlicker * kAllanFlicker, tau_h / 3, tau_h * tau_h / 2};
}

/// Rows: points; columns: the noises of `columns`, as a fraction of the point's expected variance, times the root of
/// its edf / 2 (the relative error of a variance with edf degrees of freedom is sqrt(2 / edf)).
struct Problem {
  Eigen::MatrixXd design;
  Eigen::VectorXd target;
};

Problem relative_problem(const AllanCurve& curve, const std::vector<AllanInterval>& intervals,
                         const std::vector<double>& expected, unsigned allowed) {
  const auto points = static_cast<Eigen::Index>(curve.points.size());
  Problem problem{Eigen::MatrixXd::Zero(points, kNoises), Eigen::VectorXd(points)};
  for (Eigen::Index i = 0; i < points; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double weight = std::sqrt(intervals[at].edf / 2) / expected[at];
    const auto unit = unit_variances(curve.points[at].tau_s);
    for (Eigen::Index k = 0; k < kNoises; ++k) {
      if (allowed >> k & 1U) problem.design(i, k) = weight * unit[static_cast<std::size_t>(k)];
    }
    problem.target(i) = weight * curve.points[at].deviation * curve.points[at].deviation;
  }
  return problem;
}

/// Least squares with all coefficients >= 0. With five columns all 31 subsets can be tried: the solution is the best
/// feasible one, without an iteration that could stall.
Eigen::VectorXd non_negative_fit(const Problem& problem) {
  Eigen::VectorXd best = Eigen::VectorXd::Zero(kNoises);
  double best_cost = problem.target.squaredNorm();
  for (unsigned support = 1; support < (1U << kNoises); ++support) {
    std::vector<Eigen::Index> columns;
    for (Eigen::Index k = 0; k < kNoises; ++k) {
      if (support & (1U << k)) columns.push_back(k);
    }
    if (static_cast<Eigen::Index>(columns.size()) > problem.design.rows()) continue;
    Eigen::MatrixXd part = problem.design(Eigen::all, columns);
    const Eigen::VectorXd scale = part.colwise().norm();
    if (!(scale.minCoeff() > 0)) continue;
    part = part * scale.cwiseInverse().asDiagonal();  // columns span many decades of tau
    const Eigen::VectorXd solved = (part.transpose() * part).ldlt().solve(part.transpose() * problem.target);
    if (!solved.allFinite() || solved.minCoeff() < 0) continue;
    const double cost = (part * solved - problem.target).squaredNorm();
    if (cost >= best_cost) continue;
    best_cost = cost;
    best.setZero();
    for (std::size_t k = 0; k < columns.size(); ++k) {
      best(columns[k]) = solved(static_cast<Eigen::Index>(k)) / scale(static_cast<Eigen::Index>(k));
    }
  }
  return best;
}

constexpr unsigned bit(Noise noise) { return 1U << noise; }

struct Fit {
  Eigen::VectorXd squares;       ///< of Q, N, B, K, R
  std::vector<double> expected;  ///< variance of each point
  double deviance = 0;           ///< Σ edf (s/e − 1 − ln s/e): twice the log-likelihood ratio to a perfect fit
};

/// Fits only the `allowed` noises. The first pass weights by the points themselves, which favours points that are too
/// low by chance; two more weight by the fit.
Fit fit_noises(const AllanCurve& curve, const std::vector<AllanInterval>& intervals, unsigned allowed) {
  Fit fit;
  for (const AllanPoint& point : curve.points) fit.expected.push_back(point.deviation * point.deviation);
  for (int pass = 0; pass < 3; ++pass) {
    fit.squares = non_negative_fit(relative_problem(curve, intervals, fit.expected, allowed));
    for (std::size_t i = 0; i < fit.expected.size(); ++i) {
      const auto unit = unit_variances(curve.points[i].tau_s);
      double total = 0;
      for (std::size_t k = 0; k < kNoises; ++k) total += fit.squares(static_cast<Eigen::Index>(k)) * unit[k];
      if (total > 0) fit.expected[i] = total;
    }
  }
  for (std::size_t i = 0; i < fit.expected.size(); ++i) {
    const double ratio = curve.points[i].deviation * curve.points[i].deviation / fit.expected[i];
    fit.deviance += intervals[i].edf * (ratio - 1 - std::log(ratio));
  }
  return fit;
}

/// Selects the slow noises that the curve shows. A rate random walk is included only if the fit without it (but with
/// flicker) is worse than chance explains in one of twenty records; a ramp only if it fits better than a rate random
/// walk. Octave points share data, so the threshold is not chi-square's 3.8 but from simulation: allan_coverage_test.
unsigned told_apart(const AllanCurve& curve, const std::vector<AllanInterval>& intervals) {
  constexpr double kThreshold = 8;
  constexpr unsigned kFast = bit(kQ) | bit(kN) | bit(kB);
  const auto deviance = [&](unsigned slow) { return fit_noises(curve, intervals, kFast | slow).deviance; };
  const double walk = deviance(bit(kK)), both = deviance(bit(kK) | bit(kR));
  if (walk - both <= kThreshold) return deviance(0) - walk > kThreshold ? kFast | bit(kK) : kFast;
  return deviance(bit(kR)) - both > kThreshold ? kFast | bit(kK) | bit(kR) : kFast | bit(kR);
}

/// The coefficient of a fitted square, if it dominates the curve at some tau.
std::optional<AllanCoefficient> resolve(Noise noise, const Eigen::VectorXd& squares, const AllanCurve& curve,
                                        const std::vector<AllanInterval>& intervals) {
  if (!(squares(noise) > 0)) return std::nullopt;
  AllanCoefficient coefficient{std::sqrt(squares(noise)), 0, 0, 0};
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const auto unit = unit_variances(curve.points[i].tau_s);
    double total = 0;
    for (std::size_t k = 0; k < kNoises; ++k) total += squares(static_cast<Eigen::Index>(k)) * unit[k];
    const double share = squares(noise) * unit[noise] / total;
    if (share <= 0.5) continue;
    if (std::isinf(least)) coefficient.from_tau_s = curve.points[i].tau_s;
    coefficient.to_tau_s = curve.points[i].tau_s;
    // Estimate from this point alone, after subtraction of the other noises. Octave points share data, so the
    // uncertainty is that of the best point, not of the sum.
    least = std::min(least, 1 / (std::sqrt(2 * intervals[i].edf) * share));
  }
  if (std::isinf(least)) return std::nullopt;
  coefficient.relative_sd = least;
  return coefficient;
}

/// Slope between neighbours an octave apart: log2 of their ratio.
bool flat(const AllanPoint& a, const AllanPoint& b) {
  return std::abs(std::log(b.deviation / a.deviation) / std::log(b.tau_s / a.tau_s)) <= 0.1;
}

/// A flat segment of the curve, first to last point. The longest one is used, then the lowest.
struct FlatSegment {
  std::size_t first = 0, last = 0, lowest_at = 0;
  double lowest = 0;
  std::size_t length() const { return last - first; }
};

/// A segment that falls on both sides is a bump: noise with one correlation time, not a bias instability.
bool is_bump(const AllanCurve& curve, const FlatSegment& segment) {
  const auto& points = curve.points;
  return segment.first > 0 && segment.last + 1 < points.size() &&
         points[segment.first - 1].deviation < segment.lowest && points[segment.last + 1].deviation < segment.lowest;
}

std::optional<FlatSegment> find_plateau(const AllanCurve& curve) {
  std::optional<FlatSegment> best;
  const auto& points = curve.points;
  for (std::size_t first = 0; first < points.size();) {
    FlatSegment segment{first, first, first, points[first].deviation};
    while (segment.last + 1 < points.size() && points[segment.last + 1].clusters >= 9 &&
           flat(points[segment.last], points[segment.last + 1])) {
      const AllanPoint& next = points[++segment.last];
      if (next.deviation < segment.lowest) segment.lowest = next.deviation, segment.lowest_at = segment.last;
    }
    first = segment.last + 1;
    if (segment.length() < 2 || is_bump(curve, segment)) continue;
    if (!best || segment.length() > best->length()) best = segment;
  }
  return best;
}

/// Relative uncertainty of B: that of the point it is read from, plus the bias of the minimum of several points below
/// their mean.
double lowest_deviation(const AllanCurve& curve, const std::vector<AllanInterval>& intervals,
                        const FlatSegment& plateau) {
  double sum = 0, weights = 0;
  for (std::size_t i = plateau.first; i <= plateau.last; ++i) {
    sum += intervals[i].edf * curve.points[i].deviation;
    weights += intervals[i].edf;
  }
  const double below = 0.5 * (1 - plateau.lowest * weights / sum);
  return std::sqrt(1 / (2 * intervals[plateau.lowest_at].edf) + below * below);
}

AllanFloor find_floor(const AllanCurve& curve) {
  const auto& points = curve.points;
  std::size_t lowest = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (points[i].deviation < points[lowest].deviation) lowest = i;
  }
  return {points[lowest].deviation, points[lowest].tau_s, lowest + 1 == points.size(), points[lowest].clusters};
}

}  // namespace

Result<AllanCoefficients> extract_coefficients(const AllanCurve& curve, const std::vector<AllanInterval>& intervals,
                                               const std::string& where) {
  if (curve.points.size() < 3 || intervals.size() != curve.points.size()) {
    return make_error(where, std::to_string(curve.points.size()) + " points on the Allan curve; expected 3 or more");
  }
  for (const AllanPoint& point : curve.points) {
    if (!(point.deviation > 0)) return make_error(where, "an Allan deviation is zero: the rate is constant");
  }
  const auto plateau = find_plateau(curve);
  const unsigned shown = told_apart(curve, intervals);
  // Without a plateau, flicker would only absorb the variance of its neighbours.
  const Eigen::VectorXd squares = fit_noises(curve, intervals, plateau ? shown : shown & ~bit(kB)).squares;
  AllanCoefficients result;
  result.quantisation_arcsec = resolve(kQ, squares, curve, intervals);
  result.angle_random_walk_deg_per_sqrt_h = resolve(kN, squares, curve, intervals);
  result.rate_random_walk_deg_per_h_sqrt_h = resolve(kK, squares, curve, intervals);
  result.rate_ramp_deg_per_h_h = resolve(kR, squares, curve, intervals);
  result.floor = find_floor(curve);
  if (plateau) {
    result.bias_instability_deg_per_h =
        AllanCoefficient{plateau->lowest / kAllanFlicker, lowest_deviation(curve, intervals, *plateau),
                         curve.points[plateau->first].tau_s, curve.points[plateau->last].tau_s};
  }
  return result;
}

}  // namespace prism::evaluation
