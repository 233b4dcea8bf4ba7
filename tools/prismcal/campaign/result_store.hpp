// SPDX-License-Identifier: MIT
// Output directory of a campaign: the plan, and for each task its result or its failure.
#pragma once

#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "tools/prismcal/campaign/plan.hpp"

namespace prism::campaign {

/// One line of plan.tsv.
struct PlannedTask {
  std::string id, gyro, model;
};

/// A task and why it has no result or was refused.
struct TaskLine {
  std::string gyro, model, why;
};

struct Failure {
  int attempts = 0;
  std::string why;
};

/// Files: tasks/ID/: a complete result, renamed into place. tasks/.ID.HOST.PID/: an unfinished one. failed/ID:
/// "ATTEMPTS\tWHY". Several processes, also on several machines, can use one store at the same time.
class ResultStore {
 public:
  explicit ResultStore(std::string folder) : folder_(std::move(folder)) {}

  const std::string& folder() const { return folder_; }
  std::string file(const std::string& name) const { return folder_ + "/" + name; }
  std::string task_folder(const std::string& id) const { return folder_ + "/tasks/" + id; }

  /// Creates the directories.
  Result<void> create() const;

  /// Writes tasks.jsonl, left_out.tsv and plan.tsv. Each file is replaced atomically.
  Result<void> write_plan(const Plan& plan) const;
  Result<std::vector<PlannedTask>> read_plan() const;
  std::vector<LeftOutInput> read_left_out() const;
  /// Errors: no plan, or no task with this id.
  Result<Task> read_task(const std::string& id) const;

  bool has_result(const std::string& id) const;
  std::unordered_set<std::string> with_result() const;
  std::unordered_map<std::string, Failure> failures() const;
  /// Returns the tasks without a result.
  std::vector<PlannedTask> tasks_to_do(const std::vector<PlannedTask>& plan) const;
  /// Returns why training rejected the data of a finished task; empty if it did not.
  std::string refusal(const std::string& id) const;

  /// Records a failure and counts the attempts.
  Result<void> add_failure(const std::string& id, const std::string& why) const;
  void clear_failure(const std::string& id) const;

  /// Creates this process's directory for the unfinished result of `id` and returns its path.
  Result<std::string> begin_task(const std::string& id) const;
  /// Syncs `unfinished` and renames it into place. If `id` already has a result, keeps that and removes `unfinished`.
  Result<void> publish_task(const std::string& unfinished, const std::string& id) const;
  /// Removes unfinished results of processes of this machine that have ended, and those older than a day.
  void sweep() const;

 private:
  std::string folder_;
};

struct Status {
  std::size_t tasks = 0, done = 0, waiting = 0;
  std::vector<TaskLine> refused;  ///< among the done ones: tasks whose data training rejected, with the reason
  std::vector<TaskLine> failed;   ///< without a result so far
  std::vector<LeftOutInput> left_out;
};

/// Errors: no plan.
Result<Status> read_status(const ResultStore& store);

}  // namespace prism::campaign
