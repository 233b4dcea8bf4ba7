// SPDX-License-Identifier: MIT
// The search for a composite model's parameters: REML over all of them at once, robust weights in turn with it.
#pragma once

#include <functional>
#include <optional>

#include "compensation/training/composite_system.hpp"
#include "compensation/training/folds.hpp"
#include "compensation/training/irlssvm.hpp"

namespace prism::training {

/// Change of a weight that ends the re-weighting.
inline constexpr double kStillWeight = 1e-3;

/// Weights v by eqs. 15 to 20 on the residuals e of the last solve, until none moves by kStillWeight or settings.limit
/// solves are done. `weight` begins and ends it. Nothing where a system is not positive definite.
std::optional<ReweightReport> reweight(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                       const ReweightSettings& settings, Eigen::VectorXd& weight);

struct CompositeFit {
  Eigen::VectorXd theta;
  Eigen::VectorXd weight;  ///< N; all 1 as the search leaves it
  double objective = 0;    ///< over the samples that were searched with last
  int evaluations = 0;
};

/// Called after each evaluation: how many are done, about how many are expected, the best objective.
using CompositeProgress = std::function<void(int done, int expected, double objective)>;

/// Several starts on every n-th sample (about 300), the best of them polished on about 500 and 1000; weights are
/// iterated before each polish. Refuses where no start has a finite objective.
Result<CompositeFit> search_composite(const CompositeSamples& samples, const ReweightSettings& settings,
                                      const CompositeProgress& progress, const std::function<bool()>& stop);

}  // namespace prism::training
