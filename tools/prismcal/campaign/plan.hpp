// SPDX-License-Identifier: MIT
// Plans a campaign as tasks: each gyro with each model. The id of a task is the hash of everything its result depends
// on.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/json_document.hpp"
#include "tools/prismcal/campaign/campaign_file.hpp"
#include "tools/prismcal/campaign/inputs.hpp"

namespace prism::campaign {

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
  std::vector<Task> tasks;  ///< sorted by gyro; models in the order of the campaign file
  std::vector<LeftOutInput> left_out;
  std::size_t gyros = 0;
};

/// Functions of the commands train and evaluate that campaigns call.
struct Work {
  std::string version;  ///< of this program
  /// Checks the options of models and judging. Errors: options that train or evaluate reject.
  std::function<Result<void>(const CampaignFile&)> check;
  /// Trains and evaluates; writes the model and the report into `folder` and returns the contents of result.json. Data
  /// that training rejects are a result (refused), not an error. Errors: problems of the machine; the task can be
  /// retried.
  std::function<Result<Json>(const Task&, const std::string& folder)> run;
};

/// Groups the recordings by the serial number and axis in their metadata. Gyros without a train or repeat recording are
/// listed in Plan::left_out. Errors: a file cannot be read, a pattern matches no file, Work::check fails, no gyro
/// is left.
Result<Plan> make_plan(const CampaignFile& file, const Work& work);

/// One line of tasks.jsonl.
Json task_json(const Task& task);
Result<Task> parse_task(std::string_view text, const std::string& where);

}  // namespace prism::campaign
