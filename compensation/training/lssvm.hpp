// SPDX-License-Identifier: MIT
// LSSVM (paper eqs. 8 and 14): one Cholesky factor and derived quantities; IR-LSSVM (section 2.3): train, weight by the
// residuals, train again; once as in the paper, or until convergence.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/result.hpp"
#include "compensation/training/held_out.hpp"
#include "compensation/training/robust.hpp"

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

  Eigen::VectorXd leave_one_out() const;
  /// Held-out residuals if each fold (0 … max) is left out; if requested, with the variance of each in units of s_f²:
  /// diag C_VV⁻¹.
  Eigen::VectorXd leave_fold_out(const Folds& folds, Eigen::VectorXd* variance = nullptr) const;
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

/// The kernel matrix in extended precision.
ExtendedMatrix extended_kernel_matrix(const Eigen::MatrixXd& points, double sigma2);

struct IrlssvmFit {
  LssvmSolution solution;    ///< alpha is 0 for dropped samples
  Eigen::VectorXd weight;    ///< v_k used in the last solve; 0: dropped
  Eigen::VectorXd residual;  ///< y − f(x_k), also for dropped samples
  Rows kept;                 ///< samples with a weight above 0, in order; the factor's rows
  LssvmFactor factor;        ///< of the last system, over `kept`
  ReweightReport report;
};

/// K is the kernel matrix over the samples, y their targets. Zero weights drop samples; at least two must remain. The
/// first solve is unweighted. Errors: those of LssvmFactor.
Result<IrlssvmFit> fit_irlssvm(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                               const ReweightSettings& settings);

/// Longer records are not refined: the matrix would need gigabytes.
inline constexpr Eigen::Index kRefinedSamples = 4000;
/// Refines the last system of a fit, `kernel` over all samples, with residuals in extended precision; updates the
/// residuals.
void refine_fit(const ExtendedMatrix& kernel, double c, const Eigen::VectorXd& y, IrlssvmFit& fit);

// Held-out errors of the LSSVM: exact from one factorisation, or by refits if the weights must not depend on the fold.

/// Unweighted errors of the held-out samples. Costs are plain means over folds of the fold's own mean (the paper's F(x)
/// is such an mae); leave-one-out counts every sample as a fold.
struct CrossValidation {
  Eigen::VectorXd residual;                ///< y minus the prediction of the model without the sample; units of y
  std::vector<double> fold_mse, fold_mae;  ///< empty for leave-one-out
  double mse = 0, mae = 0;
  std::vector<int> fold_solves;  ///< robust: weighted solves per fold
};

/// Plain LSSVM (no weights) from one factorisation: all folds, or without folds all samples. `scale` turns normalised
/// units into the target's.
Result<CrossValidation> cross_validate(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                       const Folds& folds, double scale);

/// IR-LSSVM: in each fold the re-weighting of `settings` uses the training part alone. LS-SVMlab's cost is limit = 30,
/// tolerance = 0 (convergence is then detected by rounding).
Result<CrossValidation> cross_validate_robust(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                              const ReweightSettings& settings, const Folds& folds, double scale);
inline constexpr int kRobustSolves = 30;

}  // namespace prism::training
