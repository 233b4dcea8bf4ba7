// SPDX-License-Identifier: MIT
// Iterative re-weighting (paper section 2.3): solve, weigh the residuals, solve again.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "base/result.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/weights.hpp"

namespace prism::training {

struct ReweightSettings {
  WeightFunction weight;  ///< kNone: plain LSSVM, no re-weighting
  ScaleKind scale = ScaleKind::kMad;
  double min_weight = 0;  ///< where a weight of zero cannot be solved with
  int limit = 500;        ///< weighted solves at most; 1 is the paper's algorithm
  /// A fixed point is reached when the 2-norm of the change of alpha is at most this (LS-SVMlab's rule, normalised
  /// units), or where double rounding of a system with this c could not show less.
  double tolerance = 1e-4;
  /// Every solve is refined by this matrix over the same samples (not owned), where there is one: needed where the
  /// re-weighting is chaotic (Hampel between two states) and rounding would grow from solve to solve.
  const ExtendedMatrix* extended = nullptr;
};

struct ReweightReport {
  int solves = 0;  ///< weighted solves done
  bool converged = false;
  bool oscillating = false;    ///< the weights alternated between two states; the mean of both was taken
  double scale = 0;            ///< robust scale that gave the last weights
  int dropped = 0;             ///< samples of weight zero
  std::vector<double> change;  ///< what the rule measured, one per solve
};

/// The weights and residuals before and after one re-weighting.
struct ReweightStep {
  const Eigen::VectorXd &weight_before, &weight, &residual_before, &residual;
};
enum class AfterStep { kContinue, kConverged, kStop };

/// Solves with these weights and returns the residuals.
using WeightedSolve = std::function<Result<Eigen::VectorXd>(const Eigen::VectorXd& weight)>;
/// Decides after each step, and appends to report.change. Once it sets report.oscillating, new weights are averaged
/// with those before.
using StepRule = std::function<AfterStep(const ReweightStep& step, ReweightReport& report)>;

/// Weights by eqs. 15 to 20. `weight`: in the first weights, out those of the last solve. Errors: those of `solve`.
Result<ReweightReport> reweight(const ReweightSettings& settings, Eigen::VectorXd& weight, const WeightedSolve& solve,
                                const StepRule& rule);

/// Converged if no residual changed by more than `tolerance` scales; the change is the 2-norm.
StepRule residuals_within(double tolerance);
/// Converged if no weight changed by 1e-3 or more. After 20 solves weights are averaged: two states in turn end in
/// their mean.
StepRule weights_settled();

}  // namespace prism::training
