// SPDX-License-Identifier: MIT
#include "compensation/training/trainer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "compensation/training/gross_outliers.hpp"
#include "compensation/training/methods.hpp"

namespace prism::training {
namespace {

// Rows that repeat an earlier one: the same inputs, target and, if known, time.
Eigen::Index repeated_rows(const TrainingData& data) {
  const Eigen::Index n = data.target.size();
  const bool timed = data.time_s.size() == n;
  std::vector<Eigen::Index> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const auto compared = [&](Eigen::Index a, Eigen::Index b) {
    if (data.target[a] != data.target[b]) return data.target[a] < data.target[b] ? -1 : 1;
    for (Eigen::Index i = 0; i < data.inputs.rows(); ++i) {
      if (data.inputs(i, a) != data.inputs(i, b)) return data.inputs(i, a) < data.inputs(i, b) ? -1 : 1;
    }
    return timed && data.time_s[a] != data.time_s[b] ? data.time_s[a] < data.time_s[b] ? -1 : 1 : 0;
  };
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return compared(a, b) < 0; });
  Eigen::Index repeats = 0;
  for (std::size_t i = 1; i < order.size(); ++i) repeats += compared(order[i - 1], order[i]) == 0;
  return repeats;
}

// Records that contain nothing to learn from; finite numbers only.
Result<void> check_content(const TrainingData& data, const TrainingSettings& settings) {
  constexpr Eigen::Index kFewestRows = 10;
  const Eigen::Index n = data.target.size();
  if (!data.inputs.allFinite() || !data.target.allFinite())
    return make_error("training data", "found a number that is not finite");
  const bool searches = settings.method->has(kOwnSearch) || (settings.method->has(kTuning) && !settings.c);
  if (searches && n < kFewestRows)
    return make_error("training data", fmt::format("found {} rows, expected at least {}", n, kFewestRows));
  if (n < 2) return make_error("training data", fmt::format("found {} rows, expected at least 2", n));
  if (data.target.minCoeff() == data.target.maxCoeff())
    return make_error("training data",
                      fmt::format("the target is {} in all {} rows, expected one that changes", data.target[0], n));
  if (const Eigen::Index repeats = repeated_rows(data); 2 * repeats >= n)
    return make_error("training data",
                      fmt::format("{} of {} rows repeat an earlier row, expected different rows", repeats, n));
  return {};
}

Result<void> check(const TrainingData& data, const TrainingSettings& settings) {
  const auto n = static_cast<std::size_t>(data.inputs.cols());
  if (data.names.size() != static_cast<std::size_t>(data.inputs.rows()) ||
      static_cast<std::size_t>(data.target.size()) != n) {
    return make_error("training data",
                      fmt::format("found {} names, {} x {} inputs, {} targets, expected matching sizes",
                                  data.names.size(), data.inputs.rows(), n, data.target.size()));
  }
  if (auto good = check_content(data, settings); !good) return good;
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

Result<TrainedModel> train_checked(const TrainingData& data, compensation::ModelInfo info,
                                   const TrainingSettings& settings, const TuningProgress& progress,
                                   const std::atomic<bool>* stop) {
  if (!settings.siblings.empty()) return train_with_siblings(data, std::move(info), settings, progress, stop);
  set_domain(data, info);
  return settings.method->train({data, std::move(info), settings, runs_of(data), progress, stop});
}

std::vector<int> runs_of(const TrainingData& data) {
  return data.runs.empty() ? std::vector<int>(static_cast<std::size_t>(data.target.size()), 0) : data.runs;
}

Folds folds_of(const TrainingData& data, const TrainingSettings& settings) {
  if (settings.tuning == Tuning::kGiven && settings.given_folds) return *settings.given_folds;
  const auto samples = static_cast<std::size_t>(data.target.size());
  const int count = static_cast<int>(std::min<Eigen::Index>(settings.folds, data.target.size()));
  if (settings.tuning == Tuning::kShuffled) return shuffled_folds(samples, count, settings.seed);
  return blocked_folds(runs_of(data), count);
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
  if (settings.method->has(kWeights) && settings.reweight.weight.kind != WeightKind::kNone) {
    const auto far = gross_outliers(data.inputs, data.target, runs_of(data));
    if (!far.empty()) return train_without(far, data, std::move(info), settings, progress, stop);
  }
  return train_checked(data, std::move(info), settings, progress, stop);
}

}  // namespace prism::training
