// SPDX-License-Identifier: MIT
// The results of a lot: each gyro with each model, its violated limits, the comparison of the gyros, and the report.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/campaign/tasks.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::campaign {

struct RecordingResult {
  std::string role, recording;
  std::string trained_on;                    ///< what it shares with the training data; empty: nothing
  std::vector<analysis::Measured> measured;  ///< without units; before_deg_per_h: 1 sigma before compensation
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
  std::size_t repeats() const;  ///< evaluations of role repeat
  /// A quantity of the lot's tables: the mean over the repeat runs, or mean_of_training_deg_per_h.
  std::optional<double> value(const std::string& quantity) const;
};

/// Returns the violated limits of `result`, one line each. A value that could not be measured violates its limit. An
/// evaluation on training data is also listed.
std::vector<std::string> find_violations(const TaskResult& result, const LotLimits& limits);

struct MissingTask {
  std::string gyro, model;
  std::string why;  ///< the last attempt failed; empty: not run yet
};

struct Lot {
  std::vector<TaskResult> results;   ///< in the order of the plan
  std::vector<MissingTask> missing;  ///< tasks without a result
  std::vector<LeftOutInput> left_out;

  /// For each gyro the result of the first accepted model in the order of `models`. Gyros without one are omitted.
  std::vector<const TaskResult*> chosen(const std::vector<ModelChoice>& models) const;
};

/// Reads all results of the plan. Errors: no plan, a result that cannot be read.
Result<Lot> read_lot(const ResultStore& store, const LotLimits& limits);

/// The lot by model, every gyro with every model, distributions, outliers, and each gyro with the one whose
/// bias-temperature curve is the most similar. `previous`: an earlier lot, for the drift since then, or null. Links to
/// tasks' pages are relative to FOLDER/report.
report::Report lot_report(const LotFile& file, const Lot& lot, const Lot* previous);

}  // namespace prism::campaign
