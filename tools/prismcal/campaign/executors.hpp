// SPDX-License-Identifier: MIT
// The engines that run the tasks of a campaign: the cores of this machine, or Slurm.
#pragma once

#include <string>
#include <vector>

#include "tools/prismcal/campaign/result_store.hpp"

namespace prism::campaign {

struct ExecutorSettings {
  std::string program;   ///< path of prismcal
  int jobs = 0;          ///< tasks at a time; 0: one per core (local)
  double memory_mb = 0;  ///< of all tasks at a time; 0: four fifths of the free memory (local)
  bool detach = false;   ///< submit and return (Slurm)
};

struct ExecutorResult {
  bool interrupted = false;
  std::size_t done = 0, failed = 0;  ///< of the tasks without a result at the start
};

/// One process per task, the longest tasks first; at most `jobs` at a time and at most their expected memory, but
/// always one. Ctrl-C and SIGTERM end them. The death of a process is recorded as a failure of its task.
Result<ExecutorResult> run_local(const CampaignFile& file, const ResultStore& store,
                                 const std::vector<PlannedTask>& plan, const ExecutorSettings& settings);

/// One Slurm job array. If an array of this campaign is in the queue already, waits for its end first. Slurm runs the
/// tasks of a dead node again. Ctrl-C and SIGTERM cancel the array.
Result<ExecutorResult> run_slurm(const CampaignFile& file, const ResultStore& store,
                                 const std::vector<PlannedTask>& plan, const ExecutorSettings& settings);

}  // namespace prism::campaign
