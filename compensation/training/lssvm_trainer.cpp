// SPDX-License-Identifier: MIT
// LSSVM and IR-LSSVM: tuned, then trained in dense or sparse form by the length of the record.
#include "compensation/training/lssvm_trainer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "compensation/training/methods.hpp"

namespace prism::training {
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

}  // namespace prism::training
