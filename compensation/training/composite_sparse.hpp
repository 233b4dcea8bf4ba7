// SPDX-License-Identifier: MIT
// Long records: the composite kernel over a few centres, with a filter for the nuisance; O(N r²) instead of O(N³).
#pragma once

#include <optional>

#include "compensation/training/composite_search.hpp"

namespace prism::training {

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
