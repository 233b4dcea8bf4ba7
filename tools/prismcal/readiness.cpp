// SPDX-License-Identifier: MIT
#include "tools/prismcal/readiness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "compensation/composite_model.hpp"
#include "compensation/extrapolation.hpp"
#include "tools/prismcal/data_quality_table.hpp"

namespace prism::commands {
namespace {

// Removes the mean of each recording: 1 sigma does not contain it.
void centre(std::vector<double>& values, const std::vector<int>& runs) {
  std::map<int, std::pair<double, double>> sums;
  for (std::size_t i = 0; i < values.size(); ++i) {
    auto& [sum, count] = sums[runs[i]];
    sum += values[i];
    ++count;
  }
  for (std::size_t i = 0; i < values.size(); ++i) values[i] -= sums[runs[i]].first / sums[runs[i]].second;
}

double sum_of_squares(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return sum;
}

// 1 sigma of the logarithm of the remaining share on another day over that of held-out parts of one day, in addition to
// next_improvement(): from 16 pairs of simulated days (docs/report.md).
constexpr double kOtherDay = 0.18;

evaluation::PredictionInterval for_another_day(evaluation::PredictionInterval interval) {
  const auto widened = [&](double end) {
    const double left = 1 - interval.value, half = std::log((1 - end) / left);
    return 1 - left * std::exp(std::copysign(std::hypot(half, 2 * kOtherDay), half));
  };
  if (!(interval.value < 1 && interval.low < interval.value && interval.value < interval.high && interval.high < 1))
    return interval;
  interval.low = widened(interval.low);
  interval.high = widened(interval.high);
  return interval;
}

bool serves_the_mean(const training::TrainedModel& trained) {
  const auto* composite = dynamic_cast<const compensation::CompositeModel*>(trained.model.get());
  if (composite == nullptr || composite->parameters().prior) return false;
  const compensation::UncertaintySettings& trust = composite->parameters().trust;
  return compensation::evidence_of(trust.skill, trust.overlap) <= compensation::kNoSkill;
}

/// Of the model and the data quality.
struct ModelJudgement {
  Readiness readiness = Readiness::kReady;
  std::string reason, advice;  // empty if ready
};

/// Names the methods that predict better, else what was tried; asks for a longer cycle only where it can help.
std::string advice_of(const Attempts& tried, double explained) {
  constexpr double kBetter = 0.05;  // of the explained variance: less may be chance
  std::string methods = tried.method;
  const auto best = std::max_element(tried.others.begin(), tried.others.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  for (const auto& other : tried.others) methods += ", " + other.first;
  const bool better = best != tried.others.end() && best->second > explained + kBetter;
  std::string text =
      better ? fmt::format(
                   "{0} predicts held-out parts better and explains {1:.0f} % of them ({2}: {3:.0f} %): train "
                   "with --method {0}",
                   best->first, 100 * best->second, tried.method, 100 * explained)
             : fmt::format("tried {} with {}", methods, tried.inputs);
  if (tried.longer_helps) return text + "; record a longer or wider cycle";
  if (better) return text;
  return text + (tried.all_inputs ? "; a longer cycle would not help: the bias follows something that is not recorded"
                                  : "; a longer cycle would not help: add inputs (--inputs auto)");
}

ModelJudgement judge_model(const training::TrainedModel& trained, const std::optional<Expectation>& expected,
                           const evaluation::DataQuality& quality, const std::function<Attempts()>& attempts) {
  if (quality.nothing_to_compensate)
    return {Readiness::kNotReady, "the bias changes with temperature by less than its noise",
            "record larger temperature changes"};
  if (quality.verdict == evaluation::Verdict::kRefuse)
    return {Readiness::kNotReady, "the data quality fails, --force was given", "record a cycle without these faults"};
  if (!expected)
    return {Readiness::kNotReady,
            fmt::format("{} samples are too few to test the model on parts of the recording",
                        trained.samples.fitted.size()),
            "record a longer cycle"};
  ModelJudgement found;
  if (serves_the_mean(trained)) {
    found = {Readiness::kNotReady,
             "the halves of the recording contradict each other, so prismd would correct only the mean", ""};
  } else if (expected->explained <= 0) {
    found = {Readiness::kNotReady, "held-out parts of the recording get worse with it", ""};
  } else if (expected->improvement && expected->improvement->low < 0.005) {  // printed as 0 %
    found = {Readiness::kDoubtful, "it may also be no improvement", ""};
  }
  if (!found.reason.empty()) found.advice = advice_of(attempts(), expected->explained);
  return found;
}

}  // namespace

std::optional<Expectation> expectation_of(const training::HeldOutErrors& held_out, const training::TrainingData& data) {
  const auto count = static_cast<std::size_t>(held_out.error.size());
  if (training::fold_count(held_out.folds) < 2 || held_out.samples.size() != count || !held_out.error.allFinite())
    return std::nullopt;
  std::vector<int> runs;
  std::vector<double> before, after(held_out.error.begin(), held_out.error.end());
  for (const Eigen::Index i : held_out.samples) {
    before.push_back(data.target[i]);
    runs.push_back(data.runs.empty() ? 0 : data.runs[static_cast<std::size_t>(i)]);
  }
  centre(before, runs);
  centre(after, runs);
  if (!(sum_of_squares(before) > 0)) return std::nullopt;
  Expectation expected{training::fold_count(held_out.folds), count, 1 - sum_of_squares(after) / sum_of_squares(before),
                       std::nullopt};
  if (const auto interval = evaluation::next_improvement(before, after, "held-out parts"))
    expected.improvement = for_another_day(*interval);
  return expected;
}

nlohmann::ordered_json expectation_json(const std::optional<Expectation>& expected) {
  if (!expected) return nullptr;
  nlohmann::ordered_json json = {{"explained", expected->explained}};
  if (const auto& interval = expected->improvement)
    json.update({{"improvement_percent", 100 * interval->value},
                 {"low_percent", 100 * interval->low},
                 {"high_percent", 100 * interval->high}});
  json.update({{"parts", expected->parts}, {"samples", expected->samples}});
  return json;
}

const char* readiness_text(Readiness readiness) {
  return readiness == Readiness::kReady ? "ready" : readiness == Readiness::kDoubtful ? "doubtful" : "not ready";
}

Judgement judge(const training::TrainedModel& trained, const std::optional<Expectation>& expected,
                const evaluation::DataQuality& quality, const std::vector<std::string>& questions,
                const std::function<Attempts()>& attempts) {
  const ModelJudgement model = judge_model(trained, expected, quality, attempts);
  std::string reason = model.reason;
  // Another cycle does not help against a fault of the data, which comes with its own advice.
  if (!model.advice.empty() && questions.empty()) reason += ": " + model.advice;
  if (questions.empty()) return {model.readiness, reason};
  // The fault may be the reason of the rest.
  const std::string others = questions.size() > 1 ? fmt::format(" (and {} more, see above)", questions.size() - 1) : "";
  return {std::max(model.readiness, Readiness::kDoubtful),
          questions.front() + others + (reason.empty() ? "" : "; " + reason)};
}

std::string first_sentence(const Judgement& judgement, const std::optional<Expectation>& expected,
                           const evaluation::DataQuality& quality, const std::string& next) {
  std::string text = std::string(readiness_text(judgement.readiness)) + ": ";
  if (!judgement.reason.empty()) text += judgement.reason + "; ";
  if (expected) {
    text += fmt::format("explains {:.0f} % of held-out variation", 100 * expected->explained);
    if (const auto& i = expected->improvement)
      text += fmt::format(", expected improvement {:.0f} % ({:.0f} to {:.0f} %)", 100 * i->value, 100 * i->low,
                          100 * i->high);
    text += "; ";
  }
  text += "data quality: " + analysis::data_quality_words(quality);
  if (judgement.readiness != Readiness::kNotReady) text += "; next: " + next;
  return text + "\n";
}

}  // namespace prism::commands
