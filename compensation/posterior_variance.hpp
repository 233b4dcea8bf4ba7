// SPDX-License-Identifier: MIT
// Variance of a kernel model's prediction (Gaussian process with an unknown constant), dense or over a few centres.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace prism::compensation {

class PosteriorVariance {
 public:
  /// `covariance`: H of the samples, noise included. Returns nullopt if it is not positive definite. O(N³/3).
  static std::optional<PosteriorVariance> dense(Eigen::MatrixXd covariance);
  /// `kernel`: K over the r centres, K = L Lᵀ. `gram`: (r + 1) × (r + 1), `c` times the precision of [w; constant] with
  /// f = w · φ + constant and φ = L⁻¹ k. Returns nullopt if one of them is not positive definite.
  static std::optional<PosteriorVariance> sparse(Eigen::MatrixXd kernel, Eigen::MatrixXd gram, double c);

  /// `k`: covariances of the point with the samples or centres; `prior`: its own variance.
  /// Dense: prior − kᵀ H⁻¹ k + (1 − nuᵀ k)² / 1ᵀ nu with nu = H⁻¹ 1, the quadratic form of the bordered inverse (eq.
  /// 14). Sparse: prior − φᵀφ + [φ; 1]ᵀ gram⁻¹ [φ; 1] / c: the part that the centres cannot express keeps its prior
  /// variance.
  double at(Eigen::VectorXd k, double prior) const;

 private:
  PosteriorVariance() = default;

  Eigen::MatrixXd factor_, gram_factor_;  // the second is empty if dense
  Eigen::VectorXd nu_;                    // dense
  double ones_ = 0;                       // dense: 1ᵀ nu
  double c_ = 1;                          // sparse
};

}  // namespace prism::compensation
