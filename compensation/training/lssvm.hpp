// SPDX-License-Identifier: MIT
// The LSSVM's linear system (paper eqs. 8 and 14): one Cholesky factor, two right-hand sides, and derived quantities.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/result.hpp"

namespace prism::training {

struct LssvmSolution {
  Eigen::VectorXd alpha;
  double b = 0;
};

/// [0 1ᵀ; 1 H] [b; alpha] = [0; y], H = K + diag(1/(c v)), K the kernel matrix. With H = L Lᵀ, nu = H⁻¹ 1, eta = H⁻¹ y:
/// b = 1ᵀ eta / 1ᵀ nu, alpha = eta − nu b. C = H⁻¹ − nu nuᵀ / 1ᵀ nu is the sample block of the bordered inverse. It
/// returns exact held-out residuals without refits: alpha_i / C_ii (Cawley and Talbot 2004), C_VV⁻¹ alpha_V for a block
/// V.
class LssvmFactor {
 public:
  /// `kernel` becomes the factor: move it in. `inverse_cv` is 1/(c v_k), finite, > 0. `y`: N. Errors: the matrix is not
  /// positive definite in double precision.
  static Result<LssvmFactor> make(Eigen::MatrixXd kernel, const Eigen::VectorXd& inverse_cv, const Eigen::VectorXd& y);

  const LssvmSolution& solution() const { return solution_; }
  /// The same system with another right-hand side [top; y].
  LssvmSolution solve(const Eigen::VectorXd& y, double top = 0) const;

  /// y − f at the training samples: alpha_k / (c v_k).
  Eigen::VectorXd residuals() const { return solution_.alpha.cwiseProduct(inverse_cv_); }
  Eigen::VectorXd leave_one_out() const;
  /// Held-out residuals if each fold (0 … max) is left out.
  Eigen::VectorXd leave_fold_out(const std::vector<int>& folds) const;
  /// The same, with the variance of each held-out residual in units of s_f²: diag C_VV⁻¹.
  Eigen::VectorXd leave_fold_out(const std::vector<int>& folds, Eigen::VectorXd& variance) const;
  /// Effective number of parameters: trace of the smoother, N − Σ C_kk / (c v_k).
  double degrees_of_freedom() const;
  /// s_f² = yᵀ alpha / (N − 1), the prior variance of the Gaussian-process reading.
  double prior_variance() const;
  /// Restricted log-likelihood of (c, sigma2): −½ [(N−1) log(2π s_f²) + log|H| + log(1ᵀ H⁻¹ 1) + N − 1].
  double restricted_log_likelihood() const;
  /// Var f / s_f² at each training sample: d − d² C_kk with d = 1/(c v_k).
  Eigen::VectorXd variance_fractions() const;

 private:
  LssvmFactor() = default;
  const Eigen::MatrixXd& inverse_factor() const;
  Eigen::VectorXd diagonal_of_c() const;

  Eigen::MatrixXd factor_;
  mutable Eigen::MatrixXd inverse_;  // L⁻¹, computed on first use
  Eigen::VectorXd inverse_cv_, y_, nu_;
  double ones_ = 0;
  LssvmSolution solution_;
};

/// The kernel matrix in extended precision (80 bits on x86-64): N² · 16 bytes.
using ExtendedMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
ExtendedMatrix extended_kernel_matrix(const Eigen::MatrixXd& points, double sigma2);

/// Refines a solution with residuals in extended precision until they stagnate, so that it does not depend on the
/// machine. `kernel` over the samples of the factor; inverse_cv and y as for the factor. Up to 12 steps, O(N²)
/// each.
void refine(const ExtendedMatrix& kernel, const Eigen::VectorXd& inverse_cv, const Eigen::VectorXd& y,
            const LssvmFactor& factor, LssvmSolution& solution);

}  // namespace prism::training
