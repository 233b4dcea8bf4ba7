// SPDX-License-Identifier: MIT
// A campaign as tasks: each gyro with each model, named by the hash of all that its result depends on.
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
  std::string path;  ///< of the recording: a file or a folder
  std::vector<InputFile> files;
};

/// Its result depends only on these members. The paths of the files are not part of its id.
struct Task {
  std::string id;  ///< 32 hex digits of the SHA-256 of the rest
  std::string serial, axis;
  ModelChoice model;
  std::vector<std::string> judging;
  std::vector<TaskInput> inputs;
  std::string version, level;  ///< of prismcal, and the instruction level that it computes at
  bool report = true;
  // Expected cost; not part of the id.
  double cpu_s = 0, memory_mb = 0;

  std::string gyro() const { return axis.empty() ? serial : serial + " " + axis; }
  std::vector<std::string> paths(Role role) const;
};

/// A recording or gyro that no task takes, and why.
struct LeftOutInput {
  std::string what, why;
};

struct Plan {
  std::vector<Task> tasks;  ///< by gyro, then by model
  std::vector<LeftOutInput> left_out;
  std::size_t gyros = 0;

  double cpu_s() const;
};

struct Cost {
  double cpu_s = 0, memory_mb = 0;
};

/// The functions of the commands (train, evaluate) that campaigns need.
struct Work {
  std::string version, level;  ///< of this program, as it was loaded
  /// Refuses options that train and evaluate do not have, or refuse.
  std::function<Result<void>(const CampaignFile&)> check;
  /// Of one task, by the seconds of the recordings that train and of those that judge. Refused: more memory than it may
  /// have.
  std::function<Result<Cost>(const Task&, std::uint64_t training_s, std::uint64_t judged_s)> cost;
  /// Trains and judges; writes the model and the report into `folder`, and returns the result (result.hpp). A refusal
  /// is a fault of the machine, not of the gyro: the task may be tried again.
  std::function<Result<Json>(const Task&, const std::string& folder)> run;
};

/// Reads what the files say of themselves, and groups them by serial number and axis. A gyro without a recording to
/// train on or without a repeat is left out and told. Refused: a file that cannot be read, a pattern that nothing fits,
/// options that Work refuses.
Result<Plan> make_plan(const CampaignFile& file, const Work& work, InputCache& cache);

/// One line, as a program takes it.
Json task_json(const Task& task);
Result<Task> parse_task(std::string_view text, const std::string& where);

}  // namespace prism::campaign
