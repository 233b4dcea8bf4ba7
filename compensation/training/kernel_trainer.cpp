// SPDX-License-Identifier: MIT
// The paper's kernels: LSSVM and IR-LSSVM, tuned, then trained in dense or sparse form by the length of the record;
// ε-SVR by libsvm (paper eqs. 2 to 4), the baseline, tuned on a log grid.
#include <fmt/format.h>
#include <libsvm/svm.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <utility>

#include "compensation/kernel.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::training {
namespace {

/// A training at one point; its results begin in `trained`.
struct KernelJob {
  TrainingJob& job;
  const NormalisedData& data;
  const TuningPoint& point;
  ReweightSettings reweight;
  TrainedModel trained;

  double scale() const { return data.constants.target_scale; }
  Eigen::VectorXd in_units(const Eigen::VectorXd& y) const { return y.array() * scale() + data.constants.target_shift; }
};

// The model of these centres, with p.alpha and p.b. `residual`: of the training, deg/h.
Result<TrainedModel> finished(KernelJob& k, const char* kind, const Rows& centres, compensation::LssvmParameters p,
                              const Eigen::VectorXd& residual) {
  p.centres = k.data.x(Eigen::all, centres);
  p.c = k.trained.c = k.point.c;
  p.sigma2 = k.trained.sigma2 = k.point.sigma2;
  k.trained.parameter = k.point.parameter;
  p.normalisation = k.data.constants;
  k.trained.samples.alpha = Eigen::VectorXd::Zero(residual.size());
  k.trained.samples.alpha(centres) = p.alpha;
  k.trained.centres = static_cast<int>(centres.size());
  k.job.info.kind = kind;
  k.job.info.spread = between_run_error_of(k.trained.held_out, residual, k.scale(), k.job.runs);
  auto model = compensation::LssvmModel::make(std::move(k.job.info), std::move(p));
  if (!model) return tl::unexpected<Error>(model.error());
  k.trained.model = std::move(*model);
  return std::move(k.trained);
}

// An LSSVM with fixed weights; samples without a weight are left out.
HeldOutErrors hold_out_lssvm(const KernelJob& k) {
  const Eigen::VectorXd& weight = k.trained.samples.weight;
  HeldOutErrors held;
  for (const Eigen::Index i : thinned(weight.size(), kErrorSamples)) {
    if (weight[i] > 0) held.samples.push_back(i);
  }
  held.folds = held_out_folds(taken(k.job.runs, held.samples));
  if (held.folds.empty()) return {};
  const Eigen::VectorXd noise = (k.point.c * weight(held.samples).array()).inverse();
  const Eigen::MatrixXd kernel = compensation::kernel_matrix(k.data.x(Eigen::all, held.samples), k.point.sigma2);
  const auto factor = LssvmFactor::make(kernel, noise, k.data.y(held.samples));
  if (!factor) return {};
  Eigen::VectorXd variance;
  held.error = k.scale() * factor->leave_fold_out(held.folds, &variance);
  held.model_variance = k.scale() * k.scale() * factor->prior_variance() * (variance - noise).cwiseMax(0);
  return held;
}

// One centre per sample: the paper's models, refined, with their uncertainty.
Result<TrainedModel> train_dense(KernelJob k) {
  constexpr double kTrustedWeight = 0.01;  // the variances at samples with a smaller weight do not represent the data
  auto fit = fit_irlssvm(compensation::kernel_matrix(k.data.x, k.point.sigma2), k.data.y, k.point.c, k.reweight);
  if (!fit) return tl::unexpected<Error>(fit.error());
  compensation::LssvmParameters p;
  p.weight = fit->weight(fit->kept);
  std::vector<double> trusted;
  const Eigen::VectorXd fractions = fit->factor.variance_fractions();
  for (Eigen::Index i = 0; i < fractions.size(); ++i) {
    if (p.weight[i] > kTrustedWeight && fractions[i] > 0) trusted.push_back(fractions[i]);
  }
  p.uncertainty.emplace();
  p.uncertainty->prior_variance = std::max(fit->factor.prior_variance(), 1e-30);
  p.uncertainty->guard_fraction = guard_of(std::move(trusted), 1);
  if (k.data.y.size() <= kRefinedSamples)
    refine_fit(extended_kernel_matrix(k.data.x, k.point.sigma2), k.point.c, k.data.y, *fit);
  p.alpha = fit->solution.alpha(fit->kept);
  p.b = fit->solution.b;
  SampleDiagnostics& samples = k.trained.samples;
  samples.weight = fit->weight;
  samples.fitted = k.in_units(k.data.y - fit->residual);
  samples.leave_one_out = fit->residual * k.scale();  // dropped samples are already held out
  samples.leave_one_out(fit->kept) = fit->factor.leave_one_out() * k.scale();
  k.trained.held_out = hold_out_lssvm(k);
  k.trained.reweight = fit->report;
  if (fit->report.oscillating)
    k.trained.notes.emplace_back("the weights alternated between two states; their mean is used");
  if (!fit->report.converged && k.reweight.limit > 1)
    k.trained.notes.emplace_back("the re-weighting did not converge within its limit");
  const char* const kind = k.reweight.weight.kind == WeightKind::kNone ? "lssvm" : "ir_lssvm";
  return finished(k, kind, fit->kept, std::move(p), fit->residual * k.scale());
}

// Long records: robust weights in the primal form over a low-rank kernel; the pivots become the centres.
Result<TrainedModel> train_sparse(KernelJob k) {
  constexpr double kAccuracy = 1e-3;  // limit of c · the part of K outside the centres
  constexpr double kStill = 1e-5;     // change of a residual, in scales, that ends the re-weighting
  const Eigen::VectorXd& y = k.data.y;
  const double c = k.point.c;
  const Eigen::Index max_rank = k.job.plan.max_rank;
  const LowRank system = low_rank(k.data.x, k.point.sigma2, kAccuracy / c, max_rank, k.job.settings.seed);
  if (system.phi.size() == 0) return make_error("sparse LSSVM", "the pivots' kernel matrix is not positive definite");
  PrimalLssvm primal(system, y, c);
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(y.size());
  const auto solve = [&](const Eigen::VectorXd& v) -> Result<Eigen::VectorXd> {
    if (primal.solve(v)) return primal.residuals();
    return make_error("sparse LSSVM", "the system is not positive definite in double precision: c is too large");
  };
  const auto report = reweight(k.reweight, weight, solve, residuals_within(kStill));
  if (!report) return tl::unexpected<Error>(report.error());
  k.trained.reweight = *report;
  const Eigen::Index r = system.rank();
  const Eigen::VectorXd residual = primal.residuals(), leverages = primal.leverages();
  compensation::LssvmParameters p;
  p.alpha = primal.theta().head(r);  // w · φ(x) = w · L⁻¹ k(x) = (L⁻ᵀ w) · k(x)
  p.b = primal.theta()[r];
  const Eigen::MatrixXd factor = pivot_factor(k.data.x(Eigen::all, system.pivots), k.point.sigma2);
  if (factor.size() > 0) solve_lower_transposed(factor, p.alpha);
  compensation::LssvmUncertainty& u = p.uncertainty.emplace();
  u.prior_variance = std::max(1e-30, c * y.dot(weight.cwiseProduct(residual)) / static_cast<double>(y.size() - 1));
  u.gram = primal.gram(weight);
  u.gram.triangularView<Eigen::StrictlyUpper>() = u.gram.transpose();
  u.gram.diagonal().head(r).array() += 1 / c;
  u.guard_fraction = std::max(1e-12, guard_of({leverages.begin(), leverages.end()}, 0) / c);
  SampleDiagnostics& samples = k.trained.samples;
  samples.weight = weight;
  samples.fitted = k.in_units(y - residual);
  samples.leave_one_out = k.scale() * residual.array() / (1 - weight.array() * leverages.array()).max(1e-12);
  if (r == max_rank && system.left * c > 10 * kAccuracy)
    k.trained.notes.push_back(fmt::format(
        "{} centres do not represent {:.2g} of the kernel: use a wider kernel or more memory", r, system.left));
  k.trained.held_out = hold_out_lssvm(k);
  return finished(k, "sparse_lssvm", system.pivots, std::move(p), residual * k.scale());
}

// Every n-th sample and its fold, at most 3000.
Result<TuningResult> tune_on_part(const NormalisedData& data, const TrainingSettings& settings, const Folds& folds) {
  const Rows part = thinned(data.y.size(), 3000);
  const Eigen::MatrixXd x = data.x(Eigen::all, part);
  const Eigen::VectorXd y = data.y(part);
  const Folds compact = numbered(taken(folds, part));
  if (fold_count(compact) < 2) return make_error("tuning", "found one fold only, expected at least 2");
  return tune({x, y, data.constants.target_scale, settings.tuning, compact, settings.reweight}, settings);
}

// On a record that drifts, two divisions into folds can choose kernels whose predictions differ by several standard
// deviations of the noise: the kernel between them is used.
Result<TuningResult> tune_lssvm(const NormalisedData& data, const TrainingSettings& wanted, const Folds& folds) {
  if (!wanted.second_folds) return tune_on_part(data, wanted, folds);
  TrainingSettings settings = wanted;
  int before = 0;
  if (wanted.progress)
    settings.progress = [&](int done, int expected, const TuningPoint& best) {
      wanted.progress(before * expected + std::min(done, expected), 2 * expected, best);
    };
  auto first = tune_on_part(data, settings, folds);
  if (!first || first->stopped) return first;
  before = 1;
  auto second = tune_on_part(data, settings, *settings.second_folds);
  first->stopped = settings.stopped();
  if (first->stopped) return first;
  if (!second) return second;
  first->evaluations += second->evaluations;
  const auto between = [](double a, double b) { return std::sqrt(a * b); };
  settings.c = between(first->best.c, second->best.c);
  settings.sigma2 = between(first->best.sigma2, second->best.sigma2);
  settings.parameter = between(first->best.parameter, second->best.parameter);
  settings.progress = {};
  settings.stop = nullptr;
  auto cost = tune_on_part(data, settings, folds);
  if (!cost) return cost;
  first->best = cost->best;
  return first;
}

// libsvm's sparse rows: (index, value) pairs, terminated by index −1; they must outlive the model.
struct SvmRows {
  SvmRows(const Eigen::MatrixXd& x, const Rows& samples)
      : nodes(samples.size() * static_cast<std::size_t>(x.rows() + 1)) {
    svm_node* next = nodes.data();
    for (const Eigen::Index sample : samples) {
      pointers.push_back(next);
      for (int j = 0; j < x.rows(); ++j) *next++ = {j + 1, x(j, sample)};
      *next++ = {-1, 0};
    }
  }
  std::vector<svm_node> nodes;
  std::vector<svm_node*> pointers;
};

std::shared_ptr<svm_model> fit_svr(SvmRows& rows, Eigen::VectorXd y, const TuningPoint& point, double epsilon) {
  svm_parameter parameter{};
  parameter.svm_type = EPSILON_SVR;
  parameter.kernel_type = RBF;
  parameter.gamma = 0.5 / point.sigma2;
  parameter.C = point.c;
  parameter.p = epsilon;
  parameter.eps = 1e-3;
  parameter.cache_size = 100;
  parameter.shrinking = 1;
  const svm_problem problem{static_cast<int>(y.size()), y.data(), rows.pointers.data()};
  return {svm_train(&problem, &parameter), [](svm_model* model) { svm_free_and_destroy_model(&model); }};
}

Eigen::VectorXd predicted(const svm_model* model, const SvmRows& rows) {
  Eigen::VectorXd y(static_cast<Eigen::Index>(rows.pointers.size()));
  for (std::size_t i = 0; i < rows.pointers.size(); ++i)
    y[static_cast<Eigen::Index>(i)] = svm_predict(model, rows.pointers[i]);
  return y;
}

// Of the samples of a fold, by a fit to the rest; numbers are those within `samples`.
FoldResidual svr_residual(const NormalisedData& data, const Rows& samples, const TuningPoint& point, double epsilon) {
  const Eigen::MatrixXd x = data.x(Eigen::all, samples);
  const Eigen::VectorXd y = data.y(samples);
  return [=](const Rows& rest, const Rows& members) -> Eigen::VectorXd {
    SvmRows rows(x, rest);
    return y(members) - predicted(fit_svr(rows, y(rest), point, epsilon).get(), SvmRows(x, members));
  };
}

Result<TuningResult> tune_svr(const NormalisedData& data, const TrainingSettings& settings, const Folds& folds) {
  TuningResult result;
  for (const double log_sigma2 : {-1.0, -0.25, 0.5, 1.25}) {
    for (const double log_c : {-0.5, 0.5, 1.5, 2.5})
      result.surface.push_back({std::pow(10, log_c), std::pow(10, log_sigma2), 1, kNever});
  }
  std::mutex mutex;
  result.best.cost = kNever;
  const int count = static_cast<int>(result.surface.size());
  const Rows all = others({}, data.y.size());
  parallel_for(count, settings.threads, [&](int i) {
    if (settings.stopped()) return;
    TuningPoint& point = result.surface[static_cast<std::size_t>(i)];
    const Eigen::VectorXd residual = held_out(folds, svr_residual(data, all, point, settings.epsilon));
    point.cost = mean_of_folds(residual, folds) * data.constants.target_scale;
    const std::lock_guard lock(mutex);
    ++result.evaluations;
    if (point.cost < result.best.cost) result.best = point;
    if (settings.progress) settings.progress(result.evaluations, count, result.best);
  });
  result.stopped = settings.stopped();
  if (!std::isfinite(result.best.cost))
    return make_error("tuning", "stopped before the first choice of c and sigma2 had a cost");
  return result;
}

Result<TrainedModel> train_svr(KernelJob k) {
  const double epsilon = k.job.settings.epsilon;
  const Rows all = others({}, k.data.y.size()), some = thinned(k.data.y.size(), kErrorSamples);
  SvmRows rows(k.data.x, all);
  const auto svm = fit_svr(rows, k.data.y, k.point, epsilon);
  Rows vectors;
  for (int i = 0; i < svm->l; ++i) vectors.push_back(svm->sv_indices[i] - 1);
  if (vectors.empty()) return make_error("svr", "found no support vector: epsilon exceeds all residuals");
  compensation::LssvmParameters p;
  p.alpha = Eigen::Map<const Eigen::VectorXd>(svm->sv_coef[0], svm->l);
  p.b = -svm->rho[0];
  k.trained.samples.weight = Eigen::VectorXd::Ones(k.data.y.size());
  k.trained.samples.fitted = k.in_units(predicted(svm.get(), rows));
  k.trained.held_out = held_out_errors(some, k.job.runs, k.scale(), svr_residual(k.data, some, k.point, epsilon));
  return finished(k, "svr", vectors, std::move(p), k.in_units(k.data.y) - k.trained.samples.fitted);
}

}  // namespace

Result<TrainedModel> train_kernel(TrainingJob job) {
  const bool svr = job.settings.method->has(kTube);
  const auto data = normalise(job.data, job.settings.scaling);
  if (!data) return tl::unexpected<Error>(data.error());
  svm_set_print_string_function([](const char*) {});
  TrainingSettings settings = job.settings;
  if (!settings.method->has(kWeights)) settings.reweight.weight.kind = WeightKind::kNone;
  WeightFunction& weight = settings.reweight.weight;
  TuningPoint point{0, 0, settings.parameter.value_or(usual_parameter(weight.kind)), 0};
  std::optional<TuningResult> tuning;
  if (settings.c && settings.sigma2) {
    point.c = *settings.c, point.sigma2 = *settings.sigma2;
  } else if (svr && (settings.tuning == Tuning::kLoo || settings.tuning == Tuning::kReml)) {
    return make_error("tuning", "found leave-one-out or reml for svr, expected folds: blocked or shuffled");
  } else {
    auto found = (svr ? tune_svr : tune_lssvm)(*data, settings, folds_of(job.data, job.settings));
    if (!found) return tl::unexpected<Error>(found.error());
    point = found->best;
    tuning = std::move(*found);
  }
  weight.parameter = point.parameter;
  const auto train_one = svr ? train_svr : job.plan.sparse ? train_sparse : train_dense;
  auto trained = train_one({job, *data, point, settings.reweight, {}});
  if (!trained) return trained;
  if (tuning) trained->notes.insert(trained->notes.end(), tuning->warnings.begin(), tuning->warnings.end());
  trained->tuning = std::move(tuning);
  return trained;
}

}  // namespace prism::training
