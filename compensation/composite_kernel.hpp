// SPDX-License-Identifier: MIT
// The composite kernel: a smooth part with one length per input, a linear and a quadratic part.
#pragma once

#include <Eigen/Core>

#include "compensation/kernel.hpp"

namespace prism::compensation {

/// k(x, x') = s1² exp(−Σ (x_i − x'_i)² / (2 l_i²)) + s2² x·x' + s3² (x·x')² on normalised inputs; variances in units of
/// the normalised target.
struct CompositeKernel {
  double rbf = 1;           ///< s1², >= 0
  Eigen::VectorXd length2;  ///< l_i², d of them, > 0
  double linear = 0;        ///< s2², >= 0
  double quadratic = 0;     ///< s3², >= 0

  /// k(x, x).
  double variance(const Eigen::VectorXd& x) const;
  /// Points in columns (d × N): the full matrix K, or its smooth part alone.
  Eigen::MatrixXd matrix(const Eigen::MatrixXd& points) const;
  Eigen::MatrixXd smooth_matrix(const Eigen::MatrixXd& points) const;
};

/// Centres with the kernel's lengths divided out, ready for fast sums and rows.
class CompositeCentres {
 public:
  /// `centres` is d × N, normalised.
  CompositeCentres(CompositeKernel kernel, const Eigen::MatrixXd& centres);

  /// Σ alpha_k k(x, centre_k) with the alpha of the last call of weigh(). Costs one kernel sum and a quadratic form,
  /// because the polynomial parts need no sum: Σ alpha_k (x·c_k)² = xᵀ (Σ alpha_k c_k c_kᵀ) x.
  void weigh(const Eigen::VectorXd& alpha);
  /// Needs weigh().
  double sum(const Eigen::VectorXd& x) const;
  /// k(x, centre_k) for all k.
  Eigen::VectorXd row(const Eigen::VectorXd& x) const;

 private:
  CompositeKernel kernel_;
  Eigen::MatrixXd points_;
  Eigen::VectorXd inverse_length_;
  KernelCentres centres_;      // with the lengths divided out
  Eigen::VectorXd alpha_;      // times s1²
  Eigen::VectorXd linear_;     // s2² Σ alpha_k c_k
  Eigen::MatrixXd quadratic_;  // s3² Σ alpha_k c_k c_kᵀ
};

}  // namespace prism::compensation
