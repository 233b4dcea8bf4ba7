// SPDX-License-Identifier: MIT
#include "compensation/training/cross_validation.hpp"

#include <numeric>

namespace prism::training {

CrossValidation fold_costs(const Eigen::VectorXd& residual, const Folds& folds, double scale) {
  CrossValidation cv;
  cv.residual = residual * scale;
  for (const auto& fold : fold_members(folds)) {
    const Eigen::VectorXd held_out = cv.residual(fold);
    cv.fold_mse.push_back(held_out.squaredNorm() / static_cast<double>(held_out.size()));
    cv.fold_mae.push_back(held_out.cwiseAbs().mean());
  }
  const double n = static_cast<double>(cv.fold_mse.size());
  cv.mse = std::accumulate(cv.fold_mse.begin(), cv.fold_mse.end(), 0.0) / n;
  cv.mae = std::accumulate(cv.fold_mae.begin(), cv.fold_mae.end(), 0.0) / n;
  return cv;
}

Result<CrossValidation> cross_validate(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                       const Folds& folds, double scale) {
  const auto factor = LssvmFactor::make(kernel, Eigen::VectorXd::Constant(y.size(), 1 / c), y);
  if (!factor) return tl::unexpected<Error>(factor.error());
  return fold_costs(factor->leave_fold_out(folds), folds, scale);
}

Result<CrossValidation> leave_one_out(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c, double scale) {
  const auto factor = LssvmFactor::make(kernel, Eigen::VectorXd::Constant(y.size(), 1 / c), y);
  if (!factor) return tl::unexpected<Error>(factor.error());
  CrossValidation cv;
  cv.residual = factor->leave_one_out() * scale;
  cv.mse = cv.residual.squaredNorm() / static_cast<double>(y.size());
  cv.mae = cv.residual.cwiseAbs().mean();
  return cv;
}

Result<CrossValidation> cross_validate_robust(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                              const ReweightSettings& settings, const Folds& folds, double scale) {
  Eigen::VectorXd residual(y.size());
  std::vector<int> solves;
  const auto members = fold_members(folds);
  for (std::size_t f = 0; f < members.size(); ++f) {
    std::vector<Eigen::Index> training;
    for (std::size_t i = 0; i < folds.size(); ++i) {
      if (folds[i] != static_cast<int>(f)) training.push_back(static_cast<Eigen::Index>(i));
    }
    ReweightSettings inside = settings;
    ExtendedMatrix extended;
    if (settings.extended) {
      extended = (*settings.extended)(training, training);
      inside.extended = &extended;
    }
    const auto fit = fit_irlssvm(kernel(training, training), y(training), c, inside);
    if (!fit) return tl::unexpected<Error>(fit.error());
    const Eigen::MatrixXd across = kernel(training, members[f]);
    residual(members[f]) = y(members[f]) - across.transpose() * fit->solution.alpha -
                           Eigen::VectorXd::Constant(across.cols(), fit->solution.b);
    solves.push_back(fit->report.solves);
  }
  CrossValidation cv = fold_costs(residual, folds, scale);
  cv.fold_solves = std::move(solves);
  return cv;
}

}  // namespace prism::training
