// SPDX-License-Identifier: MIT
// IR-LSSVM (paper section 2.3): train, weight by the residuals, train again; once as in the paper, or until
// convergence.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/result.hpp"
#include "compensation/training/folds.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/reweighting.hpp"

namespace prism::training {

struct IrlssvmFit {
  LssvmSolution solution;          ///< alpha is 0 for dropped samples
  Eigen::VectorXd weight;          ///< v_k used in the last solve; 0: dropped
  Eigen::VectorXd residual;        ///< y − f(x_k), also for dropped samples
  std::vector<Eigen::Index> kept;  ///< samples with a weight above 0, in order; the factor's rows
  LssvmFactor factor;              ///< of the last system, over `kept`
  ReweightReport report;
};

/// K is the kernel matrix over the samples, y their targets. Zero weights drop samples; at least two must remain. The
/// first solve is unweighted unless `start` contains weights. Errors: those of LssvmFactor.
Result<IrlssvmFit> fit_irlssvm(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                               const ReweightSettings& settings, const Eigen::VectorXd* start = nullptr);

/// refine() for the last system of a fit, `kernel` over all samples; updates the residuals.
void refine_fit(const ExtendedMatrix& kernel, double c, const Eigen::VectorXd& y, IrlssvmFit& fit);

/// The smallest change of alpha that a system with this c can resolve in double precision.
double rounding_floor(double c, const Eigen::VectorXd& alpha);

// Held-out errors of the LSSVM: exact from one factorisation, or by refits if the weights must not depend on the fold.

/// Unweighted errors of the held-out samples. Costs are plain means over folds of the fold's own mean (the paper's F(x)
/// is such an mae); leave-one-out counts every sample as a fold.
struct CrossValidation {
  Eigen::VectorXd residual;  ///< y minus the prediction of the model without the sample; units of y
  std::vector<double> fold_mse, fold_mae;
  double mse = 0, mae = 0;
  std::vector<int> fold_solves;  ///< robust: weighted solves per fold
};

/// Costs of given held-out residuals; `scale` turns normalised units into the target's.
CrossValidation fold_costs(const Eigen::VectorXd& residual, const Folds& folds, double scale);

/// Plain LSSVM (no weights): all folds, or all samples, from one factorisation.
Result<CrossValidation> cross_validate(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                       const Folds& folds, double scale);
Result<CrossValidation> leave_one_out(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c, double scale);

/// IR-LSSVM: in each fold the re-weighting of `settings` uses the training part alone. LS-SVMlab's cost is limit = 30,
/// tolerance = 0 (convergence is then detected by rounding).
Result<CrossValidation> cross_validate_robust(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                              const ReweightSettings& settings, const Folds& folds, double scale);
inline constexpr int kRobustSolves = 30;

}  // namespace prism::training
