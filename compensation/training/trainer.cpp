// SPDX-License-Identifier: MIT
#include "compensation/training/trainer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <set>

#include "compensation/training/dense.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/robust.hpp"

namespace prism::training {
namespace {

constexpr double kFlops = 4e9;  // of one core, a conservative estimate
constexpr Eigen::Index kAny = std::numeric_limits<Eigen::Index>::max();

ResourcePlan plan_polynomial(double n, const TrainingSettings& settings) {
  return {n * 16 * static_cast<double>(settings.terms.size() + 2) * 2};
}

// Kernel, factor and inverse in double, plus the kernel in extended precision.
ResourcePlan plan_lssvm(double n, const TrainingSettings& settings) {
  const bool robust = settings.method->has(kWeights) && settings.reweight.weight.kind != WeightKind::kNone;
  const int solves = !robust ? 2 : settings.reweight.limit == 1 ? 3 : 30;
  return {n * n * (3 * 8 + (n <= kRefinedSamples ? 16 : 0)), n * n * n / 3 * solves / kFlops};
}

ResourcePlan plan_svr(double n, const TrainingSettings&) { return {n * n * 4 + 200e6, n * n * 1e-7}; }

// The covariance, its parts, the model's factor.
ResourcePlan plan_composite(double n, const TrainingSettings&) {
  const double searched = std::min(n, 1000.0);
  return {n * n * 5 * 8, (searched * searched * searched * 60 + n * n * n / 3 * 15) / kFlops};
}

constexpr Method kMethods[] = {
    {"composite", kWeights | kOwnSearch | kSiblings | kDrift, plan_composite, 3000, 400, train_composite},
    {"ls", kCubic, plan_polynomial, kAny, 0, train_polynomial},
    {"stepwise", kTerms, plan_polynomial, kAny, 0, train_polynomial},
    {"lssvm", kTuning | kExactFolds, plan_lssvm, 5000, 600, train_kernel},
    {"ir-lssvm", kWeights | kTuning | kExactFolds, plan_lssvm, 5000, 600, train_kernel},
    {"svr", kTuning | kTube, plan_svr, kAny, 0, train_kernel}};

// Rows that repeat an earlier one: the same target, inputs and, if known, time.
Eigen::Index repeated_rows(const TrainingData& data) {
  std::vector<std::vector<double>> rows;
  for (Eigen::Index i = 0; i < data.target.size(); ++i) {
    rows.push_back({data.target[i]});
    rows.back().insert(rows.back().end(), data.inputs.col(i).begin(), data.inputs.col(i).end());
    if (data.time_s.size() == data.target.size()) rows.back().push_back(data.time_s[i]);
  }
  std::sort(rows.begin(), rows.end());
  return static_cast<Eigen::Index>(rows.end() - std::unique(rows.begin(), rows.end()));
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
  assert(data.names.size() == static_cast<std::size_t>(data.inputs.rows()) && data.target.size() == data.inputs.cols());
  assert(settings.tuning != Tuning::kGiven || (settings.given_folds && settings.given_folds->size() == n));
  const bool searches = settings.method->has(kOwnSearch) || (settings.method->has(kTuning) && !settings.c);
  if (auto good = check_content(data, searches); !good) return good;
  if (settings.c.has_value() != settings.sigma2.has_value())
    return make_error("c and sigma2", "found one of them, expected both or none");
  assert(settings.c.value_or(1) > 0 && settings.sigma2.value_or(1) > 0 && settings.parameter.value_or(1) > 0);
  const bool folded = searches && (settings.tuning == Tuning::kBlocked || settings.tuning == Tuning::kShuffled);
  if (folded && (settings.folds < 2 || static_cast<std::size_t>(settings.folds) > n))
    return make_error("folds", fmt::format("found {}, expected 2 to the number of samples, {}", settings.folds, n));
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
                      fmt::format("found {} of {} rows far from all others, expected at most a quarter: rows {}",
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

Result<ResourcePlan> plan_resources(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings) {
  constexpr Eigen::Index kMinRank = 50;
  const Method& method = *settings.method;
  const double n = static_cast<double>(samples), limit = settings.memory_limit_bytes;
  ResourcePlan plan = method.plan(n, settings);
  if (samples > method.dense_samples) {  // as many centres as fit in memory
    const double fixed = n * 8 * static_cast<double>(inputs + 12), fits = (0.8 * limit - fixed) / (8 * n) - 2;
    const Eigen::Index rank = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(fits), 0, method.most_centres);
    const double r = static_cast<double>(rank);
    plan = {fixed + n * 8 * (r + 1) + 6 * 8 * r * r, n * r * r * 25 / kFlops, true, rank};
    if (rank < kMinRank)
      return make_error("memory", fmt::format("{} samples leave memory for {} centres within {:.0f} MB, expected at "
                                              "least {}: use fewer samples",
                                              samples, rank, limit / 1e6, kMinRank));
  }
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
  for (const Method& method : kMethods) {
    if (name == method.name) return &method;
  }
  return nullptr;
}

std::string method_names(unsigned uses, const char* last) {
  std::vector<std::string> names;
  for (const Method& method : kMethods) {
    if ((method.uses & uses) != 0) names.emplace_back(method.name);
  }
  const std::string end = std::move(names.back());
  names.pop_back();
  return fmt::format("{}{}{}", fmt::join(names, ", "), names.empty() ? "" : last, end);
}

// Engineering units → the normalised units of the kernels.

namespace {

struct Constants {
  double shift = 0, scale = 1;
};

// Sums in long double: the constants then do not depend on the order or the width of vectors.
Constants constants_of(const Eigen::VectorXd& v, NormalisationMethod scaling, bool divisor_n) {
  if (scaling == NormalisationMethod::kNone) return {};
  const long double n = static_cast<long double>(v.size());
  if (scaling == NormalisationMethod::kAuto) {
    const std::set<double> distinct(v.begin(), v.end());
    const double low = *distinct.begin(), high = *distinct.rbegin();
    if (distinct.size() == 2) return {(low + high) / 2, (high - low) / 2};
    if (static_cast<long double>(distinct.size()) < std::sqrt(n)) return {};
  }
  long double sum = 0, squares = 0;
  for (const double value : v) sum += value;
  const long double mean = sum / n;
  for (const double value : v) squares += (value - mean) * (value - mean);
  return {static_cast<double>(mean), static_cast<double>(std::sqrt(squares / (divisor_n ? n : n - 1)))};
}

}  // namespace

Result<NormalisedData> normalise(const TrainingData& raw, NormalisationMethod scaling) {
  const Eigen::MatrixXd& inputs = raw.inputs;
  if (inputs.cols() < 2) return make_error("training data", "found fewer than two rows, expected at least 2");
  if (!inputs.allFinite() || !raw.target.allFinite())
    return make_error("training data", "found a number that is not finite");
  NormalisedData data;
  compensation::Normalisation& n = data.constants;
  n.input_shift.resize(inputs.rows());
  n.input_scale.resize(inputs.rows());
  for (Eigen::Index i = 0; i < inputs.rows(); ++i) {
    const Constants c = constants_of(inputs.row(i), scaling, false);
    // A column that repeats one decimal number has a standard deviation of rounding noise instead of zero.
    if (!(c.scale > 1e-14 * std::fabs(c.shift)) || !(c.scale > 0))
      return make_error(raw.names[static_cast<std::size_t>(i)], "the input is constant, expected one that changes");
    n.input_shift[i] = c.shift;
    n.input_scale[i] = c.scale;
  }
  const Constants t = constants_of(raw.target, scaling, true);
  n.target_shift = t.shift;
  n.target_scale = t.scale > 0 ? t.scale : 1;
  data.x = normalised_inputs(inputs, n);
  data.y = (raw.target.array() - n.target_shift) / n.target_scale;
  return data;
}

Eigen::MatrixXd normalised_inputs(const Eigen::MatrixXd& inputs, const compensation::Normalisation& constants) {
  return ((inputs.colwise() - constants.input_shift).array().colwise() / constants.input_scale.array()).matrix();
}

}  // namespace prism::training
