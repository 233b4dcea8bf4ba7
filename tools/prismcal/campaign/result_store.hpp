// SPDX-License-Identifier: MIT
// The folder of a campaign on the disk: its plan, and for each task its result, its running mark or its error.
#pragma once

#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "tools/prismcal/campaign/plan.hpp"

namespace prism::campaign {

/// One line of plan.tsv: the part of a task that a status needs.
struct PlannedTask {
  std::string id, gyro, model;
  double cpu_s = 0, memory_mb = 0;
};

/// A task and the text to print about it.
struct TaskLine {
  std::string gyro, model, why;
};

struct Failure {
  int attempts = 0;
  std::string why;
};

/// tasks/ID: what stands, whole, renamed into place. failed/ID: "ATTEMPTS\tWHY". running/ID: touched by the task while
/// it works. Names that begin with a dot are unfinished. Any number of programs may work on one store, on several
/// machines.
class ResultStore {
 public:
  explicit ResultStore(std::string folder) : folder_(std::move(folder)) {}

  const std::string& folder() const { return folder_; }
  std::string file(const std::string& name) const { return folder_ + "/" + name; }
  std::string task_folder(const std::string& id) const { return folder_ + "/tasks/" + id; }

  /// Makes the folders. Errors: those of the file system.
  Result<void> create() const;

  /// plan.tsv and tasks.jsonl: the old ones or the new ones.
  Result<void> write_plan(const Plan& plan) const;
  Result<std::vector<PlannedTask>> read_plan() const;
  std::vector<LeftOutInput> read_left_out() const;
  /// Errors: no plan, or no task with this id.
  Result<Task> read_task(const std::string& id) const;

  bool has_result(const std::string& id) const;
  std::unordered_set<std::string> with_result() const;
  std::unordered_map<std::string, Failure> failures() const;
  /// The tasks without a result, the longest first.
  std::vector<PlannedTask> tasks_to_do(const std::vector<PlannedTask>& plan) const;
  /// Touched within the last half minute.
  std::unordered_set<std::string> running() const;

  /// Of a task that stands and that the training refused; empty where it did not.
  std::string refusal(const std::string& id) const;

  Result<void> add_failure(const std::string& id, const std::string& why) const;
  void clear_failure(const std::string& id) const;
  void touch_running(const std::string& id) const;
  void clear_running(const std::string& id) const;

  /// A new unfinished folder for `id`, of this process.
  Result<std::string> begin_task(const std::string& id) const;
  /// Waits for the disk and renames it into place. Where another was first, that one stands and this one goes.
  Result<void> publish_task(const std::string& unfinished, const std::string& id) const;
  /// Removes unfinished folders of processes that are gone: of this machine, or a day old.
  void sweep() const;

 private:
  std::string folder_;
};

}  // namespace prism::campaign
