// SPDX-License-Identifier: MIT
// The tasks of a lot: each gyro with each model. Planned, stored in the lot's folder, run one by one.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/lot_file.hpp"

namespace prism::campaign {

struct InputFile {
  std::string path, sha256;
  bool operator==(const InputFile&) const = default;
};

struct TaskInput {
  Role role = Role::kTrain;
  std::string path;  ///< the recording: a file or a folder
  std::vector<InputFile> files;
};

/// The result depends only on these members. The id does not include the model's name and the directories of the files.
struct Task {
  std::string id;  ///< first 32 hex digits of the SHA-256 of the other members
  std::string serial, axis;
  ModelChoice model;
  std::vector<std::string> judging;
  std::vector<TaskInput> inputs;
  std::string version;  ///< of prismcal
  bool report = true;

  std::string gyro() const { return axis.empty() ? serial : serial + " " + axis; }
  std::vector<std::string> paths(Role role) const;
};

/// A recording or gyro without a task, and the reason.
struct LeftOutInput {
  std::string what, why;
};

struct Plan {
  std::vector<Task> tasks;  ///< sorted by gyro; models in the order of the file
  std::vector<LeftOutInput> left_out;
};

/// Groups the recordings by serial number and axis. Gyros without a train or repeat recording are listed in
/// Plan::left_out. Errors: a file cannot be read, a pattern matches no file, no gyro is left.
Result<Plan> make_plan(const LotFile& file);

struct RecordingResult {
  std::string role, recording;
  std::string trained_on;                    ///< overlap_text(); empty: not on data of this recording
  std::vector<analysis::Measured> measured;  ///< without units; before_deg_per_h: 1 sigma before compensation
};

struct TaskResult {
  Task task;
  std::string id, level;  ///< of the model; of the processor
  std::string refused;    ///< why training or evaluation rejected the data; empty: they did not
  bool simulated = false;
  nlohmann::ordered_json data_quality = nlohmann::ordered_json::array();  ///< of each training recording
  std::optional<double> mean_deg_per_h;                                   ///< mean bias of the training blocks
  std::vector<std::pair<double, double>> curve;  ///< degC; mean bias there minus mean_deg_per_h
  std::vector<RecordingResult> evaluations;
  std::vector<std::string> violations;  ///< of the lot's limits, one line each; not stored

  bool accepted() const { return violations.empty(); }
};

/// As it is stored.
nlohmann::ordered_json result_json(const TaskResult& result);

// The folder of a lot. tasks.jsonl: the plan, one line per task or input that is left out. tasks/ID/: a complete
// result, renamed into place; tasks/.ID.HOST.PID/: an unfinished one. failed/ID: why the last attempt failed. Several
// processes, also on several machines, can use it at the same time.

std::string task_folder(const std::string& folder, const std::string& id);
bool has_result(const std::string& folder, const std::string& id);
/// Why the last attempt failed; empty: it did not.
std::string failure(const std::string& folder, const std::string& id);

/// Creates the folder and replaces the plan.
Result<void> write_plan(const std::string& folder, const Plan& plan);
/// Reads also plans of version 0.3. `id`: reads this task only. Errors: no plan, or no task with this id.
Result<Plan> read_plan(const std::string& folder, const std::string& id = {});
/// Errors: no result, or one of another version.
Result<TaskResult> read_result(const std::string& folder, const Task& task);

/// Trains and evaluates; writes the model and the report into `folder`. Data that training rejects are a result
/// (refused), not an error. Errors: problems of the machine; the task can be retried.
using Work = std::function<Result<TaskResult>(const Task&, const std::string& folder)>;

/// Checks that the inputs are unchanged since the plan, does the work in a temporary directory and renames it into
/// place: result.json and the files of `work`. Returns at once if the task has a result. Errors, also stored in
/// failed/: changed inputs, a plan of another version than `file.version`, I/O errors, errors of `work`.
Result<void> run_task(const LotFile& file, const Task& task, const Work& work);

}  // namespace prism::campaign
