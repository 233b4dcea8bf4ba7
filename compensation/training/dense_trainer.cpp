// SPDX-License-Identifier: MIT
// LSSVM and IR-LSSVM with one centre per sample: the paper's models, refined, with their uncertainty.
#include <cmath>

#include "compensation/kernel.hpp"
#include "compensation/training/between_run_error.hpp"
#include "compensation/training/lssvm_trainer.hpp"

namespace prism::training {
namespace {

constexpr Eigen::Index kRefinedSamples = 4000;
constexpr double kTrustedWeight = 0.01;  // the variances at samples with a smaller weight do not represent the data

double guard_of(const Eigen::VectorXd& fractions, const Eigen::VectorXd& weight) {
  std::vector<double> trusted;
  for (Eigen::Index i = 0; i < fractions.size(); ++i) {
    if (weight[i] > kTrustedWeight && fractions[i] > 0) trusted.push_back(fractions[i]);
  }
  return trusted.empty() ? 1 : kGuardFactor * order_statistic(std::move(trusted), kGuardQuantile);
}

SampleDiagnostics diagnostics_of(const IrlssvmFit& fit, const NormalisedData& data) {
  const compensation::Normalisation& n = data.constants;
  SampleDiagnostics d;
  d.alpha = fit.solution.alpha;
  d.weight = fit.weight;
  d.fitted = (data.y - fit.residual).array() * n.target_scale + n.target_shift;
  d.leave_one_out = fit.residual * n.target_scale;  // dropped samples are already held out
  d.leave_one_out(fit.kept) = fit.factor.leave_one_out() * n.target_scale;
  return d;
}

}  // namespace

Result<TrainedModel> train_dense(const NormalisedData& data, compensation::ModelInfo info,
                                 const TrainingSettings& settings, const std::vector<int>& runs,
                                 const TuningPoint& point) {
  const Eigen::MatrixXd kernel = compensation::kernel_matrix(data.x, {point.sigma2});
  auto fit = fit_irlssvm(kernel, data.y, point.c, settings.reweight);
  if (!fit) return tl::unexpected<Error>(fit.error());
  TrainedModel trained;
  const double prior = fit->factor.prior_variance();
  compensation::LssvmUncertainty uncertainty;
  uncertainty.prior_variance = std::max(prior, 1e-30);
  uncertainty.guard_fraction = guard_of(fit->factor.variance_fractions(), fit->weight(fit->kept));
  if (data.y.size() <= kRefinedSamples) refine_fit(extended_kernel_matrix(data.x, point.sigma2), point.c, data.y, *fit);
  trained.samples = diagnostics_of(*fit, data);
  compensation::LssvmParameters p;
  p.centres = data.x(Eigen::all, fit->kept);
  p.alpha = fit->solution.alpha(fit->kept);
  p.weight = fit->weight(fit->kept);
  p.b = fit->solution.b;
  p.c = point.c;
  p.sigma2 = point.sigma2;
  p.normalisation = data.constants;
  p.uncertainty = uncertainty;
  const double scale = data.constants.target_scale;
  trained.held_out = hold_out_lssvm(data, fit->weight, runs, point.c, point.sigma2);
  info.spread = between_run_error_of(trained.held_out, fit->residual * scale, scale, runs);
  info.kind = settings.reweight.weight.kind == WeightKind::kNone ? "lssvm" : "ir_lssvm";
  auto model = compensation::LssvmModel::make(std::move(info), std::move(p));
  if (!model) return tl::unexpected<Error>(model.error());
  trained.model = std::move(*model);
  trained.centres = static_cast<int>(fit->kept.size());
  trained.reweight = fit->report;
  if (fit->report.oscillating) trained.notes.push_back("the weights alternated between two states; their mean is used");
  if (!fit->report.converged && settings.reweight.limit > 1) {
    trained.notes.push_back("the re-weighting did not converge within its limit");
  }
  return trained;
}

}  // namespace prism::training
