// SPDX-License-Identifier: MIT
// The search for a composite model's parameters: REML over all of them, alternating with robust weights.
#pragma once

#include <functional>
#include <optional>

#include "compensation/training/composite_system.hpp"
#include "compensation/training/folds.hpp"
#include "compensation/training/reweighting.hpp"

namespace prism::training {

/// Minimum weight: with a weight of zero H would not be finite.
inline constexpr double kMinCompositeWeight = 1e-7;

/// Re-weights the system by its noise residuals until the weights converge. `weight`: first weights in, last weights
/// out. Returns nullopt if a system is not positive definite.
std::optional<CompositeSystem> reweighted_system(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                 ReweightSettings settings, Eigen::VectorXd& weight,
                                                 ReweightReport& report);

/// The weights take rows with a smaller one for outliers.
inline constexpr double kBelievedWeight = 0.3;
/// Standard deviation of y without the rows that the weights take for outliers.
double believed_sd(const Eigen::VectorXd& y, const Eigen::VectorXd& weight);

struct CompositeFit {
  Eigen::VectorXd theta;
  Eigen::VectorXd weight;  ///< N; the first ones after the search
  double objective = 0;    ///< over the samples of the last search
  int evaluations = 0;
};

/// Called after each evaluation with the number done, the approximate number expected and the best objective.
using CompositeProgress = std::function<void(int done, int expected, double objective)>;

/// Several starts on every n-th sample (about 300), then the best is refined on about 500 and 1000; weights are
/// iterated before each refinement, from `first` (N; empty: all 1). Errors: no start has a finite objective.
Result<CompositeFit> search_composite(const CompositeSamples& samples, const ReweightSettings& settings,
                                      const DriftPrior& drift, const CompositeProgress& progress,
                                      const std::function<bool()>& stop, const Eigen::VectorXd& first = {});

// Long records: the composite kernel over a few centres, with a filter for the nuisance; O(N r²) instead of O(N³).

/// f(x) ≈ wᵀ φ(x), φ = L⁻¹ k(x), L Lᵀ = K over the centres (Nyström; Williams and Seeger 2001), w ~ N(0, 1).
struct SparseComposite {
  std::vector<Eigen::Index> centres;  ///< indices of the samples
  Eigen::VectorXd alpha;              ///< of the centres
  double beta = 0;
  Eigen::MatrixXd gram;      ///< [I 0; 0 0] + Ψ Λ⁻¹ Ψᵀ, Ψ = [φ; 1] over the samples
  Eigen::VectorXd weight;    ///< N
  Eigen::VectorXd residual;  ///< y − f − beta, N
  ReweightReport reweight;
  double left = 0;  ///< largest share of the kernel variance outside the centres, over the samples tried
};

/// Centres by pivoted Cholesky among at most 4000 samples, until the rest is far below the noise or there are
/// `max_rank`; re-weighted as in reweighted_system(). Returns nullopt if a system is not positive definite.
std::optional<SparseComposite> fit_sparse_composite(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                    ReweightSettings settings, Eigen::Index max_rank);

}  // namespace prism::training
