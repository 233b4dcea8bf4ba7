// SPDX-License-Identifier: MIT
#include "compensation/training/trainer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "compensation/training/dense.hpp"
#include "compensation/training/gross_outliers.hpp"

namespace prism::training {
namespace {

constexpr Method kMethods[] = {
    {"composite", "default", kWeights | kOwnSearch | kSiblings | kDrift, plan_composite, train_composite},
    {"ls", "", kCubic, plan_polynomial, train_polynomial},
    {"stepwise", "", kTerms, plan_polynomial, train_polynomial},
    {"lssvm", "", kTuning | kExactFolds, plan_lssvm, train_kernel},
    {"ir-lssvm", "default with --c, --sigma2 or --tune", kWeights | kTuning | kExactFolds, plan_lssvm, train_kernel},
    {"svr", "", kTuning | kTube, plan_svr, train_kernel}};

std::string joined(const std::vector<std::string>& words, const char* last) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) text += (i == 0 ? "" : i + 1 == words.size() ? last : ", ") + words[i];
  return text;
}

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
Result<void> check_content(const TrainingData& data, bool searches) {
  constexpr Eigen::Index kFewestRows = 10;
  const Eigen::Index n = data.target.size(), least = searches ? kFewestRows : 2;
  if (!data.inputs.allFinite() || !data.target.allFinite())
    return make_error("training data", "found a number that is not finite");
  if (n < least) return make_error("training data", fmt::format("found {} rows, expected at least {}", n, least));
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
  const bool searches = settings.method->has(kOwnSearch) || (settings.method->has(kTuning) && !settings.c);
  if (auto good = check_content(data, searches); !good) return good;
  if (settings.c.has_value() != settings.sigma2.has_value())
    return make_error("c and sigma2", "found one of them, expected both or none");
  for (const auto& value : {settings.c, settings.sigma2, settings.parameter}) {
    if (value && !(*value > 0 && std::isfinite(*value)))
      return make_error("c, sigma2 and the weight's parameter",
                        fmt::format("found {}, expected a positive number", *value));
  }
  if (!(settings.epsilon >= 0))
    return make_error("epsilon", fmt::format("found {}, expected at least 0", settings.epsilon));
  const bool folded = searches && (settings.tuning == Tuning::kBlocked || settings.tuning == Tuning::kShuffled);
  if (folded && (settings.folds < 2 || static_cast<std::size_t>(settings.folds) > n))
    return make_error("folds", fmt::format("found {}, expected 2 to the number of samples, {}", settings.folds, n));
  if (settings.tuning == Tuning::kGiven && (!settings.given_folds || settings.given_folds->size() != n))
    return make_error("folds", "found fewer folds than samples, expected one fold number per sample");
  return {};
}

TrainingData part_of(const TrainingData& data, const Rows& kept) {
  TrainingData part{data.names, data.inputs(Eigen::all, kept), data.target(kept), {}, {}};
  if (!data.runs.empty()) part.runs = numbered(taken(data.runs, kept));
  if (data.time_s.size() == data.target.size()) part.time_s = data.time_s(kept);
  return part;
}

// Of all rows: those that were left out have no weight, and are predicted by the model.
SampleDiagnostics with_left_out(SampleDiagnostics kept, const Rows& rest, const TrainingData& data,
                                const compensation::Model& model) {
  Eigen::VectorXd bias(data.target.size());
  for (Eigen::Index i = 0; i < bias.size(); ++i) bias[i] = model.bias_deg_per_h(column(data.inputs, i));
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(bias.size()), error = data.target - bias;
  const auto spread = [&rest](Eigen::VectorXd& values, Eigen::VectorXd all) {
    if (values.size() > 0) all(rest) = values, values = std::move(all);
  };
  spread(kept.alpha, none);
  spread(kept.weight, none);
  spread(kept.fitted, bias);
  spread(kept.leave_one_out, error);
  return kept;
}

// Robust weights start from the residuals of an unweighted fit, which a gross outlier moves without limit: such rows
// (`far`, not empty) are left out first, and the notes name them. Without them the start is the paper's.
Result<TrainedModel> train_without(const Rows& far, const TrainingData& data, compensation::ModelInfo info,
                                   const TrainingSettings& wanted) {
  constexpr Eigen::Index kMostShare = 4;
  const Eigen::Index n = data.target.size();
  if (static_cast<Eigen::Index>(far.size()) * kMostShare > n)
    return make_error("training data",
                      fmt::format("found {} of {} rows far from all others, expected at most a quarter: "
                                  "rows {}",
                                  far.size(), n, rows_text(far)));
  const Rows rest = others(far, n);
  TrainingSettings settings = wanted;
  if (wanted.given_folds) settings.given_folds = numbered(taken(*wanted.given_folds, rest));
  const bool divided = wanted.tuning == Tuning::kBlocked || wanted.tuning == Tuning::kShuffled;
  if (divided) settings.second_folds = numbered(taken(folds_of(data, wanted), rest));
  auto trained = train_checked(part_of(data, rest), std::move(info), settings);
  if (!trained) return trained;
  trained->samples = with_left_out(std::move(trained->samples), rest, data, *trained->model);
  for (Eigen::Index& sample : trained->held_out.samples) sample = rest[static_cast<std::size_t>(sample)];
  trained->notes.push_back(
      fmt::format("{} of {} rows are far from all others and were left out: rows {}", far.size(), n, rows_text(far)));
  return trained;
}

}  // namespace

std::string ResourcePlan::text() const {
  return fmt::format("{}, about {:.0f} MB and {:.1f} s",
                     sparse ? fmt::format("sparse model of at most {} centres", max_rank) : "one centre per sample",
                     std::ceil(bytes / 1e6), seconds);
}

ResourcePlan plan_sparse(Eigen::Index samples, Eigen::Index inputs, double limit_bytes, Eigen::Index most) {
  const double n = static_cast<double>(samples), fixed = n * 8 * static_cast<double>(inputs + 12);
  const double fits = (0.8 * limit_bytes - fixed) / (8 * n) - 2;
  const Eigen::Index rank = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(fits), 0, most);
  const double r = static_cast<double>(rank);
  return {fixed + n * 8 * (r + 1) + 6 * 8 * r * r, n * r * r * 25 / kFlops, true, rank};
}

Result<ResourcePlan> plan_resources(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings) {
  constexpr Eigen::Index kMinRank = 50;
  const ResourcePlan plan = settings.method->plan(samples, inputs, settings);
  const double limit = settings.memory_limit_bytes;
  if (plan.sparse && plan.max_rank < kMinRank)
    return make_error("memory", fmt::format("{} samples leave memory for {} centres within {:.0f} MB, expected at "
                                            "least {}: use fewer samples",
                                            samples, plan.max_rank, limit / 1e6, kMinRank));
  if (plan.bytes <= limit) return plan;
  return make_error("memory", fmt::format("{} samples need about {:.0f} MB, expected at most {:.0f} MB", samples,
                                          plan.bytes / 1e6, limit / 1e6));
}

std::vector<int> runs_of(const TrainingData& data) {
  return data.runs.empty() ? std::vector<int>(static_cast<std::size_t>(data.target.size()), 0) : data.runs;
}

Eigen::VectorXd time_of(const TrainingData& data) {
  constexpr double kRowInterval_h = 100.0 / 3600;
  const Eigen::Index n = data.target.size();
  if (data.time_s.size() == n) return data.time_s / 3600;
  return Eigen::VectorXd::LinSpaced(n, 0, kRowInterval_h * static_cast<double>(n - 1));
}

Folds folds_of(const TrainingData& data, const TrainingSettings& settings) {
  if (settings.tuning == Tuning::kGiven && settings.given_folds) return *settings.given_folds;
  const auto samples = static_cast<std::size_t>(data.target.size());
  const int count = static_cast<int>(std::min<Eigen::Index>(settings.folds, data.target.size()));
  if (settings.tuning == Tuning::kShuffled) return shuffled_folds(samples, count, settings.seed);
  return blocked_folds(runs_of(data), count);
}

Result<TrainedModel> train_checked(const TrainingData& data, compensation::ModelInfo info,
                                   const TrainingSettings& settings) {
  if (!settings.siblings.empty()) return train_with_siblings(data, std::move(info), settings);
  const auto plan = plan_resources(data.inputs.cols(), data.inputs.rows(), settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  const Eigen::VectorXd low = data.inputs.rowwise().minCoeff(), high = data.inputs.rowwise().maxCoeff();
  info.inputs = data.names;
  info.domain = {{low.begin(), low.end()}, {high.begin(), high.end()}};
  if (info.provenance_json.empty()) info.provenance_json = "{}";
  return settings.method->train({data, std::move(info), settings, *plan, runs_of(data)});
}

Result<TrainedModel> train(const TrainingData& data, compensation::ModelInfo info, const TrainingSettings& settings) {
  if (auto good = check(data, settings); !good) return tl::unexpected<Error>(good.error());
  if (settings.method->has(kWeights) && settings.reweight.weight.kind != WeightKind::kNone) {
    const Rows far = gross_outliers(data.inputs, data.target, runs_of(data));
    if (!far.empty()) return train_without(far, data, std::move(info), settings);
  }
  return train_checked(data, std::move(info), settings);
}

std::span<const Method> methods() { return kMethods; }

const Method* find_method(std::string_view name) {
  const auto found =
      std::find_if(std::begin(kMethods), std::end(kMethods), [&](const Method& m) { return name == m.name; });
  return found == std::end(kMethods) ? nullptr : found;
}

const Method& default_method(bool tuned) { return *find_method(tuned ? "ir-lssvm" : "composite"); }

std::string method_names(unsigned uses, const char* last) {
  std::vector<std::string> names;
  for (const Method& method : kMethods) {
    if ((method.uses & uses) != 0) names.emplace_back(method.name);
  }
  return joined(names, last);
}

std::string method_help() {
  std::vector<std::string> names;
  for (const Method& method : kMethods)
    names.push_back(*method.help ? fmt::format("{} ({})", method.name, method.help) : method.name);
  return joined(names, " or ");
}

}  // namespace prism::training
