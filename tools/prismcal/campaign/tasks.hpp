// SPDX-License-Identifier: MIT
// The tasks of a lot: each gyro with each model. Planned, stored in the lot's folder, run one by one.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/json_document.hpp"
#include "tools/prismcal/campaign/lot_file.hpp"

namespace prism::campaign {

struct InputFile {
  std::string path, sha256;
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
  std::size_t gyros = 0;
};

/// The functions of train and evaluate that a lot calls.
struct Work {
  std::string version;  ///< of this program
  /// Errors: options of models and judging that train or evaluate reject.
  std::function<Result<void>(const LotFile&)> check;
  /// Trains and evaluates; writes the model and the report into `folder` and returns the contents of result.json. Data
  /// that training rejects are a result (refused), not an error. Errors: problems of the machine; the task can be
  /// retried.
  std::function<Result<Json>(const Task&, const std::string& folder)> run;
};

/// Groups the recordings by serial number and axis. Gyros without a train or repeat recording are listed in
/// Plan::left_out. Errors: a file cannot be read, a pattern matches no file, Work::check fails, no gyro is left.
Result<Plan> make_plan(const LotFile& file, const Work& work);

/// A task as it is stored and read back.
std::string task_text(const Task& task);
Result<Task> parse_task(std::string_view text, const std::string& where);

/// One line of plan.tsv: a task, or a gyro or recording that is left out (`id` is "-", `model` the reason).
struct PlannedTask {
  std::string id, gyro, model;
  bool left_out() const { return id == "-"; }
};

/// The folder of a lot. plan.tsv: one line per task; tasks.jsonl: the tasks. tasks/ID/: a complete result, renamed into
/// place; tasks/.ID.HOST.PID/: an unfinished one. failed/ID: why the last attempt failed. Several processes, also on
/// several machines, can use it at the same time.
class ResultStore {
 public:
  explicit ResultStore(std::string folder) : folder_(std::move(folder)) {}

  const std::string& folder() const { return folder_; }
  std::string file(const std::string& name) const { return folder_ + "/" + name; }
  std::string task_folder(const std::string& id) const { return file("tasks/" + id); }

  /// Creates the directories and replaces plan.tsv and tasks.jsonl.
  Result<void> write_plan(const Plan& plan) const;
  /// Errors: no plan. Reads also plans of version 0.3.
  Result<std::vector<PlannedTask>> read_plan() const;
  /// Errors: no plan, or no task with this id.
  Result<Task> read_task(const std::string& id) const;

  bool has_result(const std::string& id) const;
  /// Why the last attempt failed; empty: it did not.
  std::string failure(const std::string& id) const;

  /// Creates this process's directory for the unfinished result of `id` and returns its path.
  Result<std::string> begin_task(const std::string& id) const;
  /// Syncs `unfinished` and renames it into place, and removes what killed processes left of this task. If `id` already
  /// has a result, keeps that and removes `unfinished`.
  Result<void> publish_task(const std::string& unfinished, const std::string& id) const;

 private:
  std::string folder_;
};

/// Checks that the inputs are unchanged since the plan, runs Work::run in a temporary directory and renames it into
/// place: task.json, result.json, times.json and the files of Work::run. Returns at once if the task has a result.
/// Errors, also stored in failed/: changed inputs, another version of prismcal, I/O errors, errors of Work::run.
Result<void> run_task(const ResultStore& store, const Task& task, const Work& work);

}  // namespace prism::campaign
