// SPDX-License-Identifier: MIT
#include "compensation/training/trainer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compensation/training/methods.hpp"

namespace prism::training {
namespace {

Result<void> check(const TrainingData& data, const TrainingSettings& settings) {
  const auto n = static_cast<std::size_t>(data.inputs.cols());
  if (data.names.size() != static_cast<std::size_t>(data.inputs.rows()) ||
      static_cast<std::size_t>(data.target.size()) != n) {
    return make_error("training data",
                      fmt::format("found {} names, {} x {} inputs, {} targets, expected matching sizes",
                                  data.names.size(), data.inputs.rows(), n, data.target.size()));
  }
  if (settings.c.has_value() != settings.sigma2.has_value())
    return make_error("c and sigma2", "found one of them, expected both or none");
  for (const auto& value : {settings.c, settings.sigma2, settings.parameter}) {
    if (value && !(*value > 0 && std::isfinite(*value)))
      return make_error("c, sigma2 and the weight's parameter",
                        fmt::format("found {}, expected a positive number", *value));
  }
  const bool folded = (settings.method->has(kTuning) || settings.method->has(kOwnSearch)) && !settings.c &&
                      (settings.tuning == Tuning::kBlocked || settings.tuning == Tuning::kShuffled);
  if (folded && (settings.folds < 2 || static_cast<std::size_t>(settings.folds) > n)) {
    return make_error("folds", fmt::format("found {}, expected 2 to the number of samples, {}", settings.folds, n));
  }
  if (settings.tuning == Tuning::kGiven && (!settings.given_folds || settings.given_folds->size() != n)) {
    return make_error("folds", "found fewer folds than samples, expected one fold number per sample");
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

Folds TrainingJob::folds() const {
  const int count = static_cast<int>(std::min<Eigen::Index>(settings.folds, data.target.size()));
  if (settings.tuning == Tuning::kGiven && settings.given_folds) return *settings.given_folds;
  if (settings.tuning == Tuning::kShuffled) return shuffled_folds(runs.size(), count, settings.seed);
  return blocked_folds(runs, count);
}

Result<NormalisedData> TrainingJob::normalised() const {
  return normalise(data.inputs, data.target, settings.scaling, data.names);
}

Result<ResourcePlan> plan_resources(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings) {
  return settings.method->plan(samples, inputs, settings);
}

Result<TrainedModel> train(const TrainingData& data, compensation::ModelInfo info, const TrainingSettings& settings,
                           const TuningProgress& progress, const std::atomic<bool>* stop) {
  if (auto good = check(data, settings); !good) return tl::unexpected<Error>(good.error());
  if (!settings.siblings.empty()) return train_with_siblings(data, std::move(info), settings, progress, stop);
  set_domain(data, info);
  std::vector<int> runs = data.runs;
  if (runs.empty()) runs.assign(static_cast<std::size_t>(data.target.size()), 0);
  return settings.method->train({data, std::move(info), settings, std::move(runs), progress, stop});
}

}  // namespace prism::training
