// SPDX-License-Identifier: MIT
// Executors for the tasks of a campaign: local processes or a Slurm job array.
#pragma once

#include <string>
#include <vector>

#include "tools/prismcal/campaign/result_store.hpp"

namespace prism::campaign {

struct ExecutorSettings {
  std::string program;   ///< path of prismcal
  int jobs = 0;          ///< local: concurrent tasks; 0: one per core
  double memory_mb = 0;  ///< local: limit for all running tasks; 0: 80 % of the free memory
  bool detach = false;   ///< Slurm: submit and return
};

struct ExecutorResult {
  bool interrupted = false;
  std::size_t done = 0, failed = 0;  ///< among the tasks that had no result at the start
};

/// Runs one process per task, longest first. Starts a task if fewer than `jobs` run and its expected memory fits, or
/// if no other task runs. Ctrl-C and SIGTERM kill the processes. If a process crashes, its task has failed.
Result<ExecutorResult> run_local(const CampaignFile& file, const ResultStore& store,
                                 const std::vector<PlannedTask>& plan, const ExecutorSettings& settings);

/// Submits one Slurm job array and waits for it. If an array of this campaign is already queued, waits for that first.
/// Slurm requeues the tasks of a dead node. Ctrl-C and SIGTERM cancel the array.
Result<ExecutorResult> run_slurm(const CampaignFile& file, const ResultStore& store,
                                 const std::vector<PlannedTask>& plan, const ExecutorSettings& settings);

}  // namespace prism::campaign
