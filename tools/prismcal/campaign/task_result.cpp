// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/task_result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "base/file.hpp"

namespace prism::campaign {
namespace {

std::optional<double> number_of(const Json& json, const char* key) {
  return json.contains(key) && json[key].is_number() ? std::optional(json[key].get<double>()) : std::nullopt;
}

RecordingResult parse_recording_result(const Json& json) {
  RecordingResult result{
      json.at("role"), json.at("recording"), json.at("trained_on"), {}, number_of(json, "before_deg_per_h")};
  for (const auto& [quantity, value] : json.at("measured").items())
    result.measured.push_back({quantity, "", value.is_number() ? std::optional(value.get<double>()) : std::nullopt});
  return result;
}

TaskResult parse_task_result(const Json& json, const PlannedTask& task) {
  TaskResult result;
  result.task = task.id;
  result.gyro = task.gyro;
  result.model = task.model;  // its current name: the stored one may be older, since the id does not contain it
  result.serial = json.at("serial");
  result.axis = json.at("axis");
  result.level = json.at("level");
  result.version = json.at("version");
  result.refused = json.at("outcome") == "refused";
  if (result.refused) {
    result.why = json.at("why");
    return result;
  }
  result.id = json.at("id");
  result.simulated = json.at("simulated");
  result.data_quality = json.at("data_quality");
  result.mean_deg_per_h = number_of(json.at("training"), "mean_deg_per_h");
  for (const Json& point : json.at("training").at("curve_degc_deg_per_h"))
    result.curve.emplace_back(point.at(0), point.at(1));
  for (const Json& evaluation : json.at("judged")) result.evaluations.push_back(parse_recording_result(evaluation));
  return result;
}

std::string range_text(const analysis::Limit& limit) {
  if (limit.min && limit.max) return fmt::format("{:g} to {:g}", *limit.min, *limit.max);
  return limit.min ? fmt::format("at least {:g}", *limit.min) : fmt::format("at most {:g}", *limit.max);
}

void add_violations(const std::string& where, const std::vector<analysis::Limit>& limits,
                    const std::vector<analysis::Measured>& measured, std::vector<std::string>& violations) {
  for (const analysis::LimitCheck& check : analysis::check_limits(limits, measured)) {
    if (check.pass) continue;
    const auto& value = check.measured.value;
    violations.push_back(fmt::format("{}: {} {}, expected {}", where, check.limit.quantity,
                                     value ? fmt::format("{:.4g}", *value) : "not measured", range_text(check.limit)));
  }
}

void add_quality_violations(const Json& quality, const CampaignLimits& limits, std::vector<std::string>& violations) {
  const std::string grade = quality.at("verdict");
  std::vector<analysis::Measured> found;
  std::string names;
  for (const Json& finding : quality.at("findings")) {
    const std::string name = finding.at("name");
    found.push_back({name, "", number_of(finding, "value")});
    if (finding.at("verdict") != "pass") names += (names.empty() ? "" : ", ") + name;
  }
  if (grade == "refuse" || (grade == "warn" && !limits.warnings_pass))
    violations.push_back(
        fmt::format("data quality: {} ({}), expected {}", grade, names, limits.warnings_pass ? "warn" : "pass"));
  // "quantised" is listed only if the rate has steps.
  std::vector<FindingLimit> applicable = limits.findings;
  std::erase_if(applicable, [&](const FindingLimit& limit) {
    return limit.quantity == "quantised" &&
           std::none_of(found.begin(), found.end(), [](const auto& m) { return m.quantity == "quantised"; });
  });
  add_violations("data quality", applicable, found, violations);
}

}  // namespace

std::optional<double> RecordingResult::value(const std::string& quantity) const {
  const auto found =
      std::find_if(measured.begin(), measured.end(), [&](const auto& m) { return m.quantity == quantity; });
  return found == measured.end() ? std::nullopt : found->value;
}

const RecordingResult* TaskResult::repeat() const {
  const auto found =
      std::find_if(evaluations.begin(), evaluations.end(), [](const auto& e) { return e.role == "repeat"; });
  return found == evaluations.end() ? nullptr : &*found;
}

Result<TaskResult> read_task_result(const ResultStore& store, const PlannedTask& task) {
  const std::string path = store.task_folder(task.id) + "/result.json";
  const auto text = read_text_file(path, kMaxModelBytes);
  if (!text) return tl::unexpected<Error>(text.error());
  try {
    return parse_task_result(Json::parse(*text), task);
  } catch (const Json::exception& error) {
    return make_error(
        path, fmt::format("found {}, expected a result of this version; remove its directory to repeat the task",
                          error.what()));
  }
}

std::vector<std::string> find_violations(const TaskResult& result, const CampaignLimits& limits) {
  if (result.refused) return {"refused: " + result.why};
  std::vector<std::string> violations;
  for (const Json& quality : result.data_quality) add_quality_violations(quality, limits, violations);
  for (const RecordingResult& recording : result.evaluations) {
    const std::string where = recording.role + " " + recording.recording;
    add_violations(where, recording.role == "repeat" ? limits.repeat : limits.other, recording.measured, violations);
    if (!recording.trained_on.empty())
      violations.push_back(where + ": not a test: the model was trained on " + recording.trained_on);
  }
  return violations;
}

std::vector<const TaskResult*> Lot::chosen(const std::vector<ModelChoice>& models) const {
  std::vector<const TaskResult*> chosen;
  std::set<std::string> seen;
  for (const TaskResult& first : results) {
    if (!seen.insert(first.gyro).second) continue;
    for (const ModelChoice& model : models) {
      const auto found = std::find_if(results.begin(), results.end(), [&](const TaskResult& o) {
        return o.gyro == first.gyro && o.model == model.name && o.accepted();
      });
      if (found == results.end()) continue;
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
      lot.missing.push_back({task.gyro, task.model, failed == failures.end() ? "not run yet" : failed->second.why});
      continue;
    }
    auto result = read_task_result(store, task);
    if (!result) return tl::unexpected<Error>(result.error());
    result->violations = find_violations(*result, limits);
    lot.results.push_back(std::move(*result));
  }
  return lot;
}

}  // namespace prism::campaign
