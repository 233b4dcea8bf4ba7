// SPDX-License-Identifier: MIT
// Iterative re-weighting (paper section 2.3): solve, weight by the residuals, solve again.
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
  double min_weight = 0;  ///< for solvers that cannot use a weight of zero
  int limit = 500;        ///< maximum number of weighted solves; 1 is the paper's algorithm
  /// Converged if the 2-norm of the change of alpha is at most this (LS-SVMlab's rule, normalised units), or below the
  /// rounding limit of a system with this c.
  double tolerance = 1e-4;
  /// If given, every solve is refined with this matrix over the same samples (not owned). Needed if the re-weighting is
  /// chaotic (Hampel between two states), because rounding would grow from solve to solve.
  const ExtendedMatrix* extended = nullptr;
};

struct ReweightReport {
  int solves = 0;  ///< number of weighted solves
  bool converged = false;
  bool oscillating = false;    ///< the weights alternated between two states; the result is their mean
  double scale = 0;            ///< robust scale of the last weights
  int dropped = 0;             ///< number of samples with weight zero
  std::vector<double> change;  ///< value of the convergence rule, one per solve
};

/// The weights and residuals before and after one re-weighting.
struct ReweightStep {
  const Eigen::VectorXd &weight_before, &weight, &residual_before, &residual;
};
enum class AfterStep { kContinue, kConverged, kStop };

/// Solves with these weights and returns the residuals.
using WeightedSolve = std::function<Result<Eigen::VectorXd>(const Eigen::VectorXd& weight)>;
/// Decides after each step, and appends to report.change. After it sets report.oscillating, new weights are averaged
/// with the previous ones.
using StepRule = std::function<AfterStep(const ReweightStep& step, ReweightReport& report)>;

/// Weights by eqs. 15 to 20. `weight`: first weights in, weights of the last solve out. Errors: those of `solve`.
Result<ReweightReport> reweight(const ReweightSettings& settings, Eigen::VectorXd& weight, const WeightedSolve& solve,
                                const StepRule& rule);

/// Converged if no residual changed by more than `tolerance` scales; the change is the 2-norm.
StepRule residuals_within(double tolerance);
/// Converged if no weight changed by 1e-3 or more. After 20 solves weights are averaged, so that an alternation between
/// two states ends at their mean.
StepRule weights_settled();

}  // namespace prism::training
