// SPDX-License-Identifier: MIT
// The result of a task, read from its folder, and whether the campaign's limits accept it.
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
  std::string trained_on;                    ///< a file of it that trained the model, too; empty: none
  std::vector<analysis::Measured> measured;  ///< without units
  std::optional<double> before_deg_per_h;    ///< 1 sigma of the block means as they were

  std::optional<double> value(const std::string& quantity) const;
};

struct TaskResult {
  std::string task, serial, axis, gyro, model, id, level, version;
  bool refused = false;
  bool simulated = false;
  std::string why;  ///< of a refusal
  std::vector<RecordingResult> judged;
  Json data_quality = Json::array();             ///< of each recording that trained
  std::optional<double> mean_deg_per_h;          ///< of the training blocks
  std::vector<std::pair<double, double>> curve;  ///< degC, mean bias there about the whole mean, deg/h
  std::vector<std::string> broken;               ///< limits that are not kept, a line each

  bool accepted() const { return broken.empty(); }
  const RecordingResult* repeat() const;  ///< the first one; null: it was refused
};

/// Errors: a result that cannot be read.
Result<TaskResult> read_outcome(const ResultStore& store, const PlannedTask& task);

/// Every limit that `outcome` does not keep. What could not be measured does not pass, nor does a judgement on what the
/// model was trained on.
std::vector<std::string> broken_limits(const TaskResult& outcome, const CampaignLimits& limits);

struct Lot {
  std::vector<TaskResult> outcomes;  ///< in the order of the plan
  std::vector<TaskLine> missing;     ///< tasks without a result, and why
  std::vector<LeftOutInput> left_out;

  /// Of each gyro the first accepted one in the order of `models`; in the order of the plan.
  std::vector<const TaskResult*> chosen(const std::vector<ModelChoice>& models) const;
};

/// All results of a plan. Errors: no plan, a result that cannot be read.
Result<Lot> read_lot(const ResultStore& store, const CampaignLimits& limits);

}  // namespace prism::campaign
