// SPDX-License-Identifier: MIT
// Held-out errors of the LSSVM: exact from one factorisation, or by refits if the weights must not depend on the fold.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "compensation/training/folds.hpp"
#include "compensation/training/irlssvm.hpp"

namespace prism::training {

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
