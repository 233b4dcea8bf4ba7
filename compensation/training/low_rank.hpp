// SPDX-License-Identifier: MIT
// K ≈ G Gᵀ by pivoted Cholesky, and the LSSVM in its primal: what makes tuning fast and long records possible.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "compensation/training/weights.hpp"

namespace prism::training {

/// f(x) = w · φ(x) + b with φ(x) = L⁻¹ k(x), L L ᵀ = K over the pivots. Columns of `phi` are [φ(x_i); 1].
/// What K holds beyond G Gᵀ is at most `left` on its diagonal; taken as nothing where c · left is small against 1.
struct LowRank {
  std::vector<Eigen::Index> pivots;  ///< the samples that became centres, in order
  Eigen::MatrixXd phi;               ///< (r + 1) × N
  double left = 0;                   ///< largest diagonal entry of K − G Gᵀ
  std::vector<double>
      left_before;  ///< the same before each pivot was taken; empty where pivots came from a part of the points
  Eigen::Index rank() const { return static_cast<Eigen::Index>(pivots.size()); }
};

/// Pivots are taken, largest diagonal first, until it falls to `tolerance` or `max_rank` pivots are used. points: d ×
/// N. Cost O(N r²), 8 N r bytes. With more than kPivotSample samples the pivots are sought among that many, drawn by
/// the seed.
LowRank low_rank(const Eigen::MatrixXd& points, double sigma2, double tolerance, Eigen::Index max_rank,
                 std::uint64_t seed = 1);
inline constexpr Eigen::Index kPivotSample = 4000;
/// What low_rank() would have given with this coarser tolerance: pivots are nested. `fine` must hold left_before.
LowRank coarser(const LowRank& fine, double tolerance);

/// The primal problem  min wᵀw/2 + c/2 Σ v_k (y_k − w·φ_k − b)²: (diag(I/c, 0) + Φ V Φᵀ) [w; b] = Φ V y.
class PrimalLssvm {
 public:
  /// Keeps references: `system` and `y` must outlive it.
  PrimalLssvm(const LowRank& system, const Eigen::VectorXd& y, double c);

  /// Solves with weights v ≥ 0 (0 leaves a sample out). False where the matrix is not positive definite.
  bool solve(const Eigen::VectorXd& weight);
  /// The same for matrices that are at hand: gram = Φ V Φᵀ (lower triangle), moment = Φ V y.
  bool solve(const Eigen::MatrixXd& gram, const Eigen::VectorXd& moment);

  const Eigen::VectorXd& theta() const { return theta_; }  ///< [w; b]
  /// y − f at every sample, those left out too.
  Eigen::VectorXd residuals() const;
  /// φᵀ (diag(I/c, 0) + Φ V Φᵀ)⁻¹ φ at every sample.
  Eigen::VectorXd leverages() const;
  /// log det of the matrix just solved with.
  double log_determinant() const;
  /// The matrix of the last solve, before its factorisation, is diag(I/c, 0) + this.
  Eigen::MatrixXd gram(const Eigen::VectorXd& weight) const;

 private:
  const LowRank& system_;
  const Eigen::VectorXd& y_;
  double c_;
  Eigen::MatrixXd factor_;
  Eigen::VectorXd theta_;
};

}  // namespace prism::training
