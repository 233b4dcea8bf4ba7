// SPDX-License-Identifier: MIT
// Reads the results of tasks and checks them against the limits of the campaign.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/campaign/result_store.hpp"

namespace prism::campaign {

struct RecordingResult {
  std::string role, recording;
  std::string trained_on;                    ///< a file of it that was also used for training; empty: none
  std::vector<analysis::Measured> measured;  ///< without units
  std::optional<double> before_deg_per_h;    ///< 1 sigma of the block means before compensation

  std::optional<double> value(const std::string& quantity) const;
};

struct TaskResult {
  std::string task, serial, axis, gyro, model, id, level, version;
  bool refused = false;  ///< training or evaluation rejected the data
  bool simulated = false;
  std::string why;  ///< reason, if refused
  std::vector<RecordingResult> evaluations;
  Json data_quality = Json::array();             ///< of each training recording
  std::optional<double> mean_deg_per_h;          ///< mean bias of the training blocks
  std::vector<std::pair<double, double>> curve;  ///< degC; mean bias there minus mean_deg_per_h
  std::vector<std::string> violations;           ///< violated limits, one line each

  bool accepted() const { return violations.empty(); }
  const RecordingResult* repeat() const;  ///< the first evaluation with role repeat; null if refused
};

/// Errors: result.json cannot be read or parsed.
Result<TaskResult> read_task_result(const ResultStore& store, const PlannedTask& task);

/// Returns the violated limits of `result`, one line each. A value that could not be measured violates its limit. An
/// evaluation on training data is also listed.
std::vector<std::string> find_violations(const TaskResult& result, const CampaignLimits& limits);

struct Lot {
  std::vector<TaskResult> results;  ///< in the order of the plan
  std::vector<TaskLine> missing;    ///< tasks without a result, and why
  std::vector<LeftOutInput> left_out;

  /// Returns for each gyro the result of the first accepted model in the order of `models`. Gyros without one are
  /// omitted.
  std::vector<const TaskResult*> chosen(const std::vector<ModelChoice>& models) const;
};

/// Reads all results of the plan. Errors: no plan, a result that cannot be read.
Result<Lot> read_lot(const ResultStore& store, const CampaignLimits& limits);

}  // namespace prism::campaign
