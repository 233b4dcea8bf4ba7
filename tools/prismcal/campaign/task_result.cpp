// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/task_result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/file.hpp"

namespace prism::campaign {
namespace {

std::optional<double> number_of(const Json& json, const char* key) {
  return json.contains(key) && json[key].is_number() ? std::optional(json[key].get<double>()) : std::nullopt;
}

RecordingResult parse_judged(const Json& json) {
  RecordingResult judged{
      json.at("role"), json.at("recording"), json.at("trained_on"), {}, number_of(json, "before_deg_per_h")};
  for (const auto& [quantity, value] : json.at("measured").items())
    judged.measured.push_back({quantity, "", value.is_number() ? std::optional(value.get<double>()) : std::nullopt});
  return judged;
}

TaskResult parse_outcome(const Json& json, const PlannedTask& task) {
  TaskResult outcome;
  outcome.task = task.id;
  outcome.gyro = task.gyro;
  outcome.model = task.model;  // as it is called now: the name is no part of a task
  outcome.serial = json.at("serial");
  outcome.axis = json.at("axis");
  outcome.level = json.at("level");
  outcome.version = json.at("version");
  outcome.refused = json.at("outcome") == "refused";
  if (outcome.refused) {
    outcome.why = json.at("why");
    return outcome;
  }
  outcome.id = json.at("id");
  outcome.simulated = json.at("simulated");
  outcome.data_quality = json.at("data_quality");
  outcome.mean_deg_per_h = number_of(json.at("training"), "mean_deg_per_h");
  for (const Json& point : json.at("training").at("curve_degc_deg_per_h"))
    outcome.curve.emplace_back(point.at(0), point.at(1));
  for (const Json& judged : json.at("judged")) outcome.judged.push_back(parse_judged(judged));
  return outcome;
}

std::string bounds_text(const analysis::Limit& limit) {
  if (limit.min && limit.max) return fmt::format("{:g} to {:g}", *limit.min, *limit.max);
  return limit.min ? fmt::format("at least {:g}", *limit.min) : fmt::format("at most {:g}", *limit.max);
}

void add_broken(const std::string& where, const std::vector<analysis::Limit>& limits,
                const std::vector<analysis::Measured>& measured, std::vector<std::string>& broken) {
  for (const analysis::LimitCheck& verdict : analysis::check_limits(limits, measured)) {
    if (verdict.pass) continue;
    const auto& value = verdict.measured.value;
    broken.push_back(fmt::format("{}: {} {}, expected {}", where, verdict.limit.quantity,
                                 value ? fmt::format("{:.4g}", *value) : "not measured", bounds_text(verdict.limit)));
  }
}

void add_broken_quality(const Json& quality, const CampaignLimits& limits, std::vector<std::string>& broken) {
  const std::string verdict = quality.at("verdict");
  std::vector<analysis::Measured> found;
  std::string warned;
  for (const Json& finding : quality.at("findings")) {
    const std::string name = finding.at("name");
    found.push_back({name, "", number_of(finding, "value")});
    if (finding.at("verdict") != "pass") warned += (warned.empty() ? "" : ", ") + name;
  }
  if (verdict == "refuse" || (verdict == "warn" && !limits.warnings_pass))
    broken.push_back(
        fmt::format("data quality: {} ({}), expected {}", verdict, warned, limits.warnings_pass ? "warn" : "pass"));
  std::vector<FindingLimit> asked = limits.findings;  // steps of the rate are found only where there are any
  std::erase_if(asked, [&](const FindingLimit& limit) {
    return limit.quantity == "quantised" &&
           std::none_of(found.begin(), found.end(), [](const auto& m) { return m.quantity == "quantised"; });
  });
  add_broken("data quality", asked, found, broken);
}

}  // namespace

std::optional<double> RecordingResult::value(const std::string& quantity) const {
  const auto found =
      std::find_if(measured.begin(), measured.end(), [&](const auto& m) { return m.quantity == quantity; });
  return found == measured.end() ? std::nullopt : found->value;
}

const RecordingResult* TaskResult::repeat() const {
  const auto found = std::find_if(judged.begin(), judged.end(), [](const auto& j) { return j.role == "repeat"; });
  return found == judged.end() ? nullptr : &*found;
}

Result<TaskResult> read_outcome(const ResultStore& store, const PlannedTask& task) {
  const std::string path = store.task_folder(task.id) + "/result.json";
  const auto text = read_text_file(path, kMaxModelBytes);
  if (!text) return tl::unexpected<Error>(text.error());
  try {
    return parse_outcome(Json::parse(*text), task);
  } catch (const Json::exception& error) {
    return make_error(path,
                      fmt::format("found {}, expected a result of this version: remove its folder to do the task again",
                                  error.what()));
  }
}

std::vector<std::string> broken_limits(const TaskResult& outcome, const CampaignLimits& limits) {
  if (outcome.refused) return {"refused: " + outcome.why};
  std::vector<std::string> broken;
  for (const Json& quality : outcome.data_quality) add_broken_quality(quality, limits, broken);
  for (const RecordingResult& judged : outcome.judged) {
    const std::string where = judged.role + " " + judged.recording;
    add_broken(where, judged.role == "repeat" ? limits.repeat : limits.other, judged.measured, broken);
    if (!judged.trained_on.empty())
      broken.push_back(where + ": no test: the model was trained on " + judged.trained_on);
  }
  return broken;
}

std::vector<const TaskResult*> Lot::chosen(const std::vector<ModelChoice>& models) const {
  std::vector<const TaskResult*> chosen;
  std::set<std::string> seen;
  for (const TaskResult& first : outcomes) {
    if (!seen.insert(first.gyro).second) continue;
    for (const ModelChoice& model : models) {
      const auto found = std::find_if(outcomes.begin(), outcomes.end(), [&](const TaskResult& o) {
        return o.gyro == first.gyro && o.model == model.name && o.accepted();
      });
      if (found == outcomes.end()) continue;
      chosen.push_back(&*found);
      break;
    }
  }
  return chosen;
}

Result<Lot> read_lot(const ResultStore& store, const CampaignLimits& limits) {
  const auto plan = store.read_plan();
  if (!plan) return tl::unexpected<Error>(plan.error());
  const auto failures = store.failures();
  Lot lot;
  lot.left_out = store.read_left_out();
  for (const PlannedTask& task : *plan) {
    if (!store.has_result(task.id)) {
      const auto failed = failures.find(task.id);
      lot.missing.push_back({task.gyro, task.model, failed == failures.end() ? "not done yet" : failed->second.why});
      continue;
    }
    auto outcome = read_outcome(store, task);
    if (!outcome) return tl::unexpected<Error>(outcome.error());
    outcome->broken = broken_limits(*outcome, limits);
    lot.outcomes.push_back(std::move(*outcome));
  }
  return lot;
}

}  // namespace prism::campaign
