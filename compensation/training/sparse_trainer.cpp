// SPDX-License-Identifier: MIT
// Long records: robust weights in the primal form over a low-rank kernel; the pivots become the centres.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compensation/kernel.hpp"
#include "compensation/training/between_run_error.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/low_rank.hpp"
#include "compensation/training/lssvm_trainer.hpp"

namespace prism::training {
namespace {

constexpr double kAccuracy = 1e-3;  // limit of c · the part of K outside the centres
constexpr double kStill = 1e-5;     // change of a residual, in scales, that ends the re-weighting

// alpha over the pivots: w · φ(x) = w · L⁻¹ k(x) = (L⁻ᵀ w) · k(x).
Eigen::VectorXd alpha_of(const Eigen::MatrixXd& centres, double sigma2, const Eigen::VectorXd& w) {
  Eigen::MatrixXd l = compensation::kernel_matrix(centres, {sigma2});
  l.diagonal().array() += 1e-15;
  Eigen::VectorXd alpha = w;
  if (cholesky(l)) solve_lower_transposed(l, alpha);
  return alpha;
}

double guard_of(const Eigen::VectorXd& leverages, double c) {
  std::vector<double> values(leverages.begin(), leverages.end());
  return std::max(1e-12, kGuardFactor * order_statistic(std::move(values), kGuardQuantile) / c);
}

}  // namespace

Result<TrainedModel> train_sparse(const NormalisedData& data, compensation::ModelInfo info,
                                  const TrainingSettings& settings, const std::vector<int>& runs,
                                  const ResourcePlan& plan, const TuningPoint& point) {
  const LowRank system = low_rank(data.x, point.sigma2, kAccuracy / point.c, plan.max_rank, settings.seed);
  if (system.phi.size() == 0) return make_error("sparse LSSVM", "the pivots' kernel matrix is not positive definite");
  PrimalLssvm primal(system, data.y, point.c);
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(data.y.size());
  const auto solve = [&](const Eigen::VectorXd& v) -> Result<Eigen::VectorXd> {
    if (primal.solve(v)) return primal.residuals();
    return make_error("sparse LSSVM", "the system is not positive definite in double precision: c is too large");
  };
  const auto report = reweight(settings.reweight, weight, solve, residuals_within(kStill));
  if (!report) return tl::unexpected<Error>(report.error());
  TrainedModel trained;
  trained.reweight = *report;
  const Eigen::Index r = system.rank();
  compensation::LssvmParameters p;
  p.centres = data.x(Eigen::all, system.pivots);
  p.alpha = alpha_of(p.centres, point.sigma2, primal.theta().head(r));
  p.b = primal.theta()[r];
  p.c = point.c;
  p.sigma2 = point.sigma2;
  p.normalisation = data.constants;
  compensation::LssvmUncertainty uncertainty;
  const Eigen::VectorXd residual = primal.residuals();
  const double n = static_cast<double>(data.y.size());
  uncertainty.prior_variance = std::max(1e-30, point.c * data.y.dot(weight.cwiseProduct(residual)) / (n - 1));
  uncertainty.gram = primal.gram(weight);
  uncertainty.gram.triangularView<Eigen::StrictlyUpper>() = uncertainty.gram.transpose();
  uncertainty.gram.diagonal().head(r).array() += 1 / point.c;
  const Eigen::VectorXd leverages = primal.leverages();
  uncertainty.guard_fraction = guard_of(leverages, point.c);
  p.uncertainty = std::move(uncertainty);
  const compensation::Normalisation& c = data.constants;
  trained.samples.alpha = Eigen::VectorXd::Zero(data.y.size());
  trained.samples.alpha(system.pivots) = p.alpha;
  trained.samples.weight = weight;
  trained.samples.fitted = (data.y - residual).array() * c.target_scale + c.target_shift;
  trained.samples.leave_one_out =
      c.target_scale * residual.array() / (1 - weight.array() * leverages.array()).max(1e-12);
  trained.centres = static_cast<int>(r);
  if (r == plan.max_rank && system.left * point.c > 10 * kAccuracy) {
    trained.notes.push_back(fmt::format(
        "{} centres do not represent {:.2g} of the kernel: use a wider kernel or more memory", r, system.left));
  }
  trained.held_out = hold_out_lssvm(data, weight, runs, point.c, point.sigma2);
  info.spread = between_run_error_of(trained.held_out, residual * c.target_scale, c.target_scale, runs);
  info.kind = "sparse_lssvm";
  auto model = compensation::LssvmModel::make(std::move(info), std::move(p));
  if (!model) return tl::unexpected<Error>(model.error());
  trained.model = std::move(*model);
  return trained;
}

}  // namespace prism::training
