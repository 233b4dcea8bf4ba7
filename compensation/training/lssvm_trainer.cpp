// SPDX-License-Identifier: MIT
// LSSVM and IR-LSSVM: tuned, then trained in dense or sparse form by the length of the record.
#include "compensation/training/lssvm_trainer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "compensation/kernel.hpp"
#include "compensation/training/between_run_error.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/low_rank.hpp"
#include "compensation/training/methods.hpp"

namespace prism::training {

// LSSVM and IR-LSSVM with one centre per sample: the paper's models, refined, with their uncertainty.

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

// Long records: robust weights in the primal form over a low-rank kernel; the pivots become the centres.

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

namespace {

constexpr Eigen::Index kTuningSamples = 3000;  // longer records are tuned on every n-th sample
constexpr Eigen::Index kDenseLimit = 5000;     // samples; above it one centre per sample needs gigabytes and minutes
constexpr Eigen::Index kMaxRank = 600;

// Every n-th sample and its fold, at most kTuningSamples.
Result<TuningResult> tune_on_part(const NormalisedData& data, const TrainingSettings& settings, const Folds& folds,
                                  const TuningProgress& progress, const std::atomic<bool>* stop) {
  const Eigen::Index n = data.y.size(), step = (n + kTuningSamples - 1) / kTuningSamples;
  std::vector<Eigen::Index> part;
  Folds part_folds;
  for (Eigen::Index i = 0; i < n; i += step) {
    part.push_back(i);
    part_folds.push_back(folds[static_cast<std::size_t>(i)]);
  }
  const Eigen::MatrixXd x = data.x(Eigen::all, part);
  const Eigen::VectorXd y = data.y(part);
  const auto compact = folds_from({part_folds.begin(), part_folds.end()});
  if (!compact) return make_error("tuning", "found one fold only, expected at least 2");
  const TuningCost cost(x, y, data.constants.target_scale, settings.tuning, *compact, settings.reweight);
  TuningSettings tuning;
  tuning.c = settings.c;
  tuning.sigma2 = settings.sigma2;
  tuning.parameter = settings.parameter;
  tuning.bounds = bounds_for(x.rows());
  tuning.threads = settings.threads;
  return tune(cost, x.cols(), tuning, progress, stop);
}

// On a record that drifts, two divisions into folds can choose kernels whose predictions differ by several standard
// deviations of the noise: the kernel between them is used.
Result<TuningResult> tuned(const NormalisedData& data, TrainingSettings settings, const Folds& folds,
                           const TuningProgress& progress, const std::atomic<bool>* stop) {
  if (!settings.second_folds) return tune_on_part(data, settings, folds, progress, stop);
  const auto half = [&progress](int before) -> TuningProgress {
    if (!progress) return {};
    return [&progress, before](int done, int expected, const TuningPoint& best) {
      progress(before * expected + std::min(done, expected), 2 * expected, best);
    };
  };
  auto first = tune_on_part(data, settings, folds, half(0), stop);
  if (!first || first->stopped) return first;
  auto second = tune_on_part(data, settings, *settings.second_folds, half(1), stop);
  first->stopped = stop && *stop;
  if (first->stopped) return first;
  if (!second) return second;
  first->evaluations += second->evaluations;
  const auto between = [](double a, double b) { return std::sqrt(a * b); };
  settings.c = between(first->best.c, second->best.c);
  settings.sigma2 = between(first->best.sigma2, second->best.sigma2);
  settings.parameter = between(first->best.parameter, second->best.parameter);
  auto cost = tune_on_part(data, settings, folds, {}, nullptr);
  if (!cost) return cost;
  first->best = cost->best;
  return first;
}

Result<ResourcePlan> plan_lssvm(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings) {
  if (samples > kDenseLimit) return plan_sparse(samples, inputs, settings.memory_limit_bytes, kMaxRank);
  const double n = static_cast<double>(samples);
  const int solves = settings.reweight.weight.kind == WeightKind::kNone ? 2 : settings.reweight.limit == 1 ? 3 : 30;
  ResourcePlan plan;
  // Kernel, factor and inverse in double, plus the kernel in extended precision.
  plan.bytes = n * n * (3 * 8 + (n <= 4000 ? 16 : 0));
  plan.seconds = n * n * n / 3 * solves / kFlops;
  return within_memory(plan, samples, settings.memory_limit_bytes);
}

Result<TrainedModel> train_lssvm(TrainingJob job) {
  const auto plan = plan_lssvm(job.data.inputs.cols(), job.data.inputs.rows(), job.settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  const auto data = job.normalised();
  if (!data) return tl::unexpected<Error>(data.error());
  TrainingSettings settings = job.settings;
  if (!settings.method->has(kWeights)) settings.reweight.weight.kind = WeightKind::kNone;
  TuningPoint point;
  std::optional<TuningResult> tuning;
  if (settings.c && settings.sigma2) {
    point = {*settings.c, *settings.sigma2, settings.parameter.value_or(usual_parameter(settings.reweight.weight.kind)),
             0};
  } else {
    auto found = tuned(*data, settings, folds_of(job.data, job.settings), job.progress, job.stop);
    if (!found) return tl::unexpected<Error>(found.error());
    point = found->best;
    tuning = std::move(*found);
  }
  settings.reweight.weight.parameter = point.parameter;
  auto trained = plan->sparse ? train_sparse(*data, std::move(job.info), settings, job.runs, *plan, point)
                              : train_dense(*data, std::move(job.info), settings, job.runs, point);
  if (!trained) return trained;
  trained->c = point.c;
  trained->sigma2 = point.sigma2;
  trained->parameter = point.parameter;
  if (tuning) trained->notes.insert(trained->notes.end(), tuning->warnings.begin(), tuning->warnings.end());
  trained->tuning = std::move(tuning);
  return trained;
}

}  // namespace

extern const Method kLssvm, kIrlssvm;
const Method kLssvm = {"lssvm", "", kTuning | kExactFolds, plan_lssvm, train_lssvm, describe_kernel};
const Method kIrlssvm = {
    "ir-lssvm",     "default with --c, --sigma2 or --tune", kWeights | kTuning | kExactFolds, plan_lssvm, train_lssvm,
    describe_kernel};

namespace {

nlohmann::ordered_json kernel_json(const TrainedModel& trained, const TrainingSettings& settings) {
  nlohmann::ordered_json json;
  if (settings.method->has(kWeights)) {
    json["weight"] = weight_name(settings.reweight.weight.kind);
    json["reweight"] = settings.reweight.limit == 1 ? "1" : "converge";
  }
  json["c"] = trained.c;
  json["sigma2"] = trained.sigma2;
  if (settings.reweight.weight.kind == WeightKind::kHuber) json["beta"] = trained.parameter;
  if (settings.reweight.weight.kind == WeightKind::kMyriad) json["delta"] = trained.parameter;
  json["cost"] = trained.tuning ? finite_json(trained.tuning->best.cost) : nlohmann::ordered_json(nullptr);
  json["centres"] = trained.centres;
  if (trained.reweight && settings.method->has(kWeights)) {
    const ReweightReport& r = *trained.reweight;
    json["reweighting"] = {{"solves", r.solves},
                           {"converged", r.converged},
                           {"oscillating", r.oscillating},
                           {"scale", finite_json(r.scale)},
                           {"dropped", r.dropped}};
  }
  if (!trained.tuning) return json;
  json["tuning"] = {{"evaluations", trained.tuning->evaluations},
                    {"stopped", trained.tuning->stopped},
                    {"surface", nlohmann::ordered_json::array()}};
  for (const TuningPoint& p : trained.tuning->surface) {
    json["tuning"]["surface"].push_back(
        {{"sigma2", p.sigma2}, {"c", p.c}, {"parameter", p.parameter}, {"cost", finite_json(p.cost)}});
  }
  return json;
}

std::string kernel_lines(const TrainedModel& trained, const TrainingSettings& settings) {
  const bool weights = settings.method->has(kWeights);
  std::string kernel = fmt::format("c {}, sigma2 {}", plain_number(trained.c, 6), plain_number(trained.sigma2, 6));
  if (weights && settings.reweight.weight.has_parameter())
    kernel += fmt::format(", {} {}", settings.reweight.weight.kind == WeightKind::kHuber ? "beta" : "delta",
                          plain_number(trained.parameter, 4));
  std::string text = detail_line("kernel", kernel + " (inputs in units of their standard deviation)");
  text += detail_line("centres", fmt::format("{} samples that the model contains", trained.centres));
  if (trained.tuning) {
    const bool likelihood = settings.tuning == Tuning::kReml;
    text += detail_line(
        "cost", fmt::format("{}{} ({}, {} evaluations{})", plain_number(trained.tuning->best.cost, 6),
                            likelihood ? ": minus the log-likelihood of a sample"
                                       : " " + target_unit(trained) + ": mean absolute error on held-out samples",
                            tuning_text(settings.tuning), trained.tuning->evaluations,
                            trained.tuning->stopped ? ", stopped early" : ""));
  }
  if (trained.reweight && weights) {
    text += detail_line("outliers", fmt::format("{} rounds of weights, {} samples left out", trained.reweight->solves,
                                                trained.reweight->dropped));
  }
  return text;
}

}  // namespace

std::string detail_line(const std::string& name, const std::string& text) {
  return fmt::format("  {:<14} {}\n", name, text);
}

std::string target_unit(const TrainedModel& trained) {
  return trained.model->info().table ? "units of the target" : "deg/h";
}

std::string plain_number(double value, int digits) {
  if (!std::isfinite(value)) return fmt::format("{}", value);
  if (value == 0) return "0";
  if (std::abs(value) < 1e-7 || std::abs(value) > 1e9) return fmt::format("{:.{}g}", value, digits);
  const int power = static_cast<int>(std::floor(std::log10(std::abs(value)))), lost = power + 1 - digits;
  if (lost <= 0) return fmt::format("{:.{}f}", value, -lost);
  const double unit = std::pow(10, lost);
  return fmt::format("{:.0f}", unit * std::round(value / unit));
}

const char* tuning_text(Tuning tuning) {
  switch (tuning) {
    case Tuning::kBlocked:
      return "blocked folds";
    case Tuning::kShuffled:
      return "shuffled folds";
    case Tuning::kGiven:
      return "given folds";
    case Tuning::kLoo:
      return "leave-one-out";
    default:
      return "reml";
  }
}

MethodSummary describe_kernel(const TrainedModel& trained, const TrainingSettings& settings,
                              const std::vector<std::string>&) {
  return {kernel_json(trained, settings), kernel_lines(trained, settings)};
}

}  // namespace prism::training
