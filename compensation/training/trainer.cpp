// SPDX-License-Identifier: MIT
#include "compensation/training/trainer.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numeric>

namespace prism::training {
namespace {

constexpr std::array kMethodNames = {"composite", "ls", "stepwise", "lssvm", "ir-lssvm", "svr"};
constexpr double kGentleParameter = 3;         // of a composite kernel's weights: a clean record loses next to nothing
constexpr Eigen::Index kTuningSamples = 3000;  // of a longer record every n-th sample tunes as well

Folds folds_of(const TrainingSettings& settings, const std::vector<int>& runs) {
  if (settings.tuning == Tuning::kGiven && settings.given_folds) return *settings.given_folds;
  if (settings.tuning == Tuning::kShuffled) return shuffled_folds(runs.size(), settings.folds, settings.seed);
  return blocked_folds(runs, settings.folds);
}

// Every n-th sample, so that no more than kTuningSamples tune; folds follow.
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
  if (!compact) return refuse("tuning", "found one fold only, expected at least 2");
  const TuningCost cost(x, y, data.constants.target_scale, settings.tuning, *compact, settings.reweight);
  TuningSettings tuning;
  tuning.c = settings.c;
  tuning.sigma2 = settings.sigma2;
  tuning.parameter = settings.parameter;
  tuning.bounds = bounds_for(x.rows());
  tuning.threads = settings.threads;
  return tune(cost, x.cols(), tuning, progress, stop);
}

bool kernels(Method method) { return method != Method::kLeastSquares && method != Method::kStepwise; }

Result<void> check(const TrainingData& data, const TrainingSettings& settings) {
  const auto n = static_cast<std::size_t>(data.inputs.cols());
  if (data.names.size() != static_cast<std::size_t>(data.inputs.rows()) ||
      static_cast<std::size_t>(data.target.size()) != n) {
    return refuse("training data",
                  fmt::format("found {} names, {} x {} inputs, {} targets: they do not belong together",
                              data.names.size(), data.inputs.rows(), n, data.target.size()));
  }
  if (settings.c.has_value() != settings.sigma2.has_value())
    return refuse("c and sigma2", "found one of them, expected both or none");
  for (const auto& value : {settings.c, settings.sigma2, settings.parameter}) {
    if (value && !(*value > 0 && std::isfinite(*value)))
      return refuse("c, sigma2 and the weight's parameter",
                    fmt::format("found {}, expected a positive number", *value));
  }
  const bool folded = kernels(settings.method) && !settings.c &&
                      (settings.tuning == Tuning::kBlocked || settings.tuning == Tuning::kShuffled);
  if (folded && (settings.folds < 2 || static_cast<std::size_t>(settings.folds) > n)) {
    return refuse("folds", fmt::format("found {}, expected 2 to the number of samples, {}", settings.folds, n));
  }
  if (settings.tuning == Tuning::kGiven && (!settings.given_folds || settings.given_folds->size() != n)) {
    return refuse("folds", "found no fold for every sample");
  }
  return {};
}

void set_domain(const TrainingData& data, compensation::ModelInfo& info) {
  info.inputs = data.names;
  info.domain = {};
  for (Eigen::Index i = 0; i < data.inputs.rows(); ++i) {
    info.domain.min.push_back(data.inputs.row(i).minCoeff());
    info.domain.max.push_back(data.inputs.row(i).maxCoeff());
  }
  if (info.provenance_json.empty()) info.provenance_json = "{}";
}

}  // namespace

const char* method_name(Method method) { return kMethodNames[static_cast<std::size_t>(method)]; }

Result<Method> parse_method(std::string_view name) {
  for (std::size_t i = 0; i < kMethodNames.size(); ++i) {
    if (name == kMethodNames[i]) return static_cast<Method>(i);
  }
  return refuse("method", fmt::format("found \"{}\", expected composite, ls, stepwise, lssvm, ir-lssvm or svr", name));
}

Result<TrainedModel> train(const TrainingData& data, compensation::ModelInfo info, const TrainingSettings& wanted,
                           const TuningProgress& progress, const std::atomic<bool>* stop) {
  if (auto good = check(data, wanted); !good) return tl::unexpected<Error>(good.error());
  if (!wanted.siblings.empty()) return train_with_siblings(data, std::move(info), wanted, progress, stop);
  set_domain(data, info);
  const std::vector<int> runs =
      data.runs.empty() ? std::vector<int>(static_cast<std::size_t>(data.target.size()), 0) : data.runs;
  if (!kernels(wanted.method)) return train_polynomial(data, std::move(info), wanted, runs);
  const auto plan = plan_resources(data.inputs.cols(), data.inputs.rows(), wanted);
  if (!plan) return tl::unexpected<Error>(plan.error());
  const auto normalised = normalise(data.inputs, data.target, wanted.scaling, data.names);
  if (!normalised) return tl::unexpected<Error>(normalised.error());
  TrainingSettings settings = wanted;
  if (settings.method == Method::kComposite) {
    settings.reweight.weight.parameter = settings.parameter.value_or(kGentleParameter);
    return train_composite(*normalised, data, std::move(info), settings, *plan, progress, stop);
  }
  settings.folds = static_cast<int>(std::min<Eigen::Index>(wanted.folds, data.target.size()));
  if (settings.method != Method::kIrlssvm) settings.reweight.weight.kind = WeightKind::kNone;
  const Folds folds = folds_of(settings, runs);
  if (settings.method == Method::kSvr)
    return train_svr(*normalised, std::move(info), settings, runs, folds, progress, stop);
  TuningPoint point;
  std::optional<TuningResult> tuning;
  if (settings.c && settings.sigma2) {
    point = {*settings.c, *settings.sigma2, settings.parameter.value_or(usual_parameter(settings.reweight.weight.kind)),
             0};
  } else {
    auto found = tune_on_part(*normalised, settings, folds, progress, stop);
    if (!found) return tl::unexpected<Error>(found.error());
    point = found->best;
    tuning = std::move(*found);
  }
  settings.reweight.weight.parameter = point.parameter;
  auto trained = plan->sparse ? train_sparse(*normalised, std::move(info), settings, runs, *plan, point)
                              : train_dense(*normalised, std::move(info), settings, runs, point);
  if (!trained) return trained;
  trained->c = point.c;
  trained->sigma2 = point.sigma2;
  trained->parameter = point.parameter;
  if (tuning) trained->notes.insert(trained->notes.end(), tuning->warnings.begin(), tuning->warnings.end());
  trained->tuning = std::move(tuning);
  return trained;
}

}  // namespace prism::training
