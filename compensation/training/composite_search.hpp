// SPDX-License-Identifier: MIT
// The search for a composite model's parameters: REML over all of them at once, robust weights in turn with it.
#pragma once

#include <functional>
#include <optional>

#include "compensation/training/composite_system.hpp"
#include "compensation/training/folds.hpp"
#include "compensation/training/reweighting.hpp"

namespace prism::training {

/// Least weight: H would not be finite with a weight of zero.
inline constexpr double kMinCompositeWeight = 1e-7;

/// The system re-weighted by its noise residuals until the weights settle. `weight`: in the first weights, out the
/// last. Returns nullopt if a system is not positive definite.
std::optional<CompositeSystem> reweighted_system(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                 ReweightSettings settings, Eigen::VectorXd& weight,
                                                 ReweightReport& report);

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
