// SPDX-License-Identifier: MIT
// The covariance function of the models (paper eq. 11), and rows, sums and matrices of it.
#pragma once

#include <Eigen/Core>
#include <span>

namespace prism::compensation {

/// k(x, x') = exp(−‖x − x'‖² / (2 sigma2)). A new parameter is a member here and a term in KernelCentres; code that
/// passes a Kernel on does not change.
struct Kernel {
  double sigma2 = 1;  ///< > 0, in normalised units
};

/// Maximum error of a single value; the error of a sum is at most this times Σ|alpha_k|. The same bits on every
/// machine.
inline constexpr double kKernelTolerance = 4e-15;

/// A set of centres x_k under one kernel.
class KernelCentres {
 public:
  /// `centres` is d × N, one centre per column.
  KernelCentres(const Eigen::MatrixXd& centres, const Kernel& kernel);

  /// Σ alpha_k k(point, x_k); alpha: N.
  double sum(std::span<const double> point, const Eigen::VectorXd& alpha) const;
  /// k(point, x_k) for the centres from `first` on; `row` has N − first elements.
  void row(std::span<const double> point, double* row, Eigen::Index first = 0) const;

 private:
  Kernel kernel_;
  Eigen::MatrixXd inputs_;  // N × d: one input per column, as the inner loops read them
};

/// K of eq. 9 for points in columns (d × N): symmetric.
Eigen::MatrixXd kernel_matrix(const Eigen::MatrixXd& points, const Kernel& kernel);

}  // namespace prism::compensation
