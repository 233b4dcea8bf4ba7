// SPDX-License-Identifier: MIT
// K ≈ G Gᵀ by pivoted Cholesky, and the LSSVM in its primal form: for fast tuning and long records.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "compensation/training/held_out.hpp"

namespace prism::training {

/// K ≈ G Gᵀ from the rows of a few pivots, which are centres: f(x) = w · φ(x) + b with φ(x) = L⁻¹ k(x), L Lᵀ = K over
/// the pivots. The diagonal of K − G Gᵀ is at most `left`, which is neglected if c · left is small against 1.
struct LowRank {
  Rows pivots;                      ///< in the order in which they were added
  Eigen::MatrixXd phi;              ///< (r + 1) × N, columns [φ(x_i); 1]: the first r rows are Gᵀ
  double left = 0;                  ///< largest diagonal entry of K − G Gᵀ
  std::vector<double> left_before;  ///< `left` before each pivot; empty if the pivots are from a part of the points
  Eigen::Index rank() const { return static_cast<Eigen::Index>(pivots.size()); }
};

/// Writes row i of K into `k`, N numbers.
using KernelRow = std::function<void(Eigen::Index i, Eigen::VectorXd& k)>;

/// Adds pivots, largest diagonal entry first, until it is at most `tolerance` or there are `max_rank`. `diagonal`: of
/// K. O(N r²), 8 N r bytes.
LowRank pivoted_cholesky(Eigen::VectorXd diagonal, const KernelRow& row, double tolerance, Eigen::Index max_rank);

/// The same for the kernel of points (d × N). With more than kPivotSample of them, searches the pivots among that many,
/// sampled by the seed.
LowRank low_rank(const Eigen::MatrixXd& points, double sigma2, double tolerance, Eigen::Index max_rank,
                 std::uint64_t seed = 1);
inline constexpr Eigen::Index kPivotSample = 4000;
/// The result of low_rank() with this coarser tolerance: pivots are nested. `fine` must contain left_before.
LowRank coarser(const LowRank& fine, double tolerance);
/// L over the pivots' points; empty if their kernel matrix is not positive definite.
Eigen::MatrixXd pivot_factor(const Eigen::MatrixXd& pivots, double sigma2);

/// The primal problem  min wᵀw/2 + c/2 Σ v_k (y_k − w·φ_k − b)²: (diag(I/c, 0) + Φ V Φᵀ) [w; b] = Φ V y.
class PrimalLssvm {
 public:
  /// `system` and `y` must outlive it.
  PrimalLssvm(const LowRank& system, const Eigen::VectorXd& y, double c) : system_(system), y_(y), c_(c) {}

  /// Solves with weights v ≥ 0 (0 leaves a sample out). Returns false if the matrix is not positive definite.
  bool solve(const Eigen::VectorXd& weight);
  /// The same with given matrices: gram = Φ V Φᵀ (lower triangle), moment = Φ V y.
  bool solve(const Eigen::MatrixXd& gram, const Eigen::VectorXd& moment);

  const Eigen::VectorXd& theta() const { return theta_; }  ///< [w; b]
  /// y − f at every sample, also those left out.
  Eigen::VectorXd residuals() const { return y_ - system_.phi.transpose() * theta_; }
  /// φᵀ (diag(I/c, 0) + Φ V Φᵀ)⁻¹ φ at every sample.
  Eigen::VectorXd leverages() const;
  /// log det of the matrix of the last solve.
  double log_determinant() const { return 2 * factor_.diagonal().array().log().sum(); }
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
