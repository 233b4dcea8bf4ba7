// SPDX-License-Identifier: MIT
// Who runs the tasks: this machine's cores, Slurm, or whatever takes a command a line.
#pragma once

#include <string>
#include <vector>

#include "tools/prismcal/campaign/store.hpp"

namespace prism::campaign {

struct EngineSettings {
  std::string program;   ///< path of prismcal
  int jobs = 0;          ///< tasks at a time; 0: one a core (local)
  double memory_mb = 0;  ///< of all tasks at a time; 0: four fifths of what is free (local)
  bool detach = false;   ///< submit and return (Slurm)
};

struct EngineEnd {
  bool interrupted = false;
  std::size_t done = 0, failed = 0;  ///< of the tasks that were to do
};

/// The command that runs one task, wherever the files are seen under the same paths; quoted for a shell.
std::string task_command(const CampaignFile& file, const EngineSettings& settings, const std::string& id);
std::string shell_quoted(const std::string& text);

/// Tasks that do not stand, the longest first.
std::vector<PlannedTask> tasks_to_do(const Store& store, const std::vector<PlannedTask>& plan);

/// A process for each task; as many at a time as there are jobs, and as their memory fits, one always. Ctrl-C or
/// SIGTERM ends those that run. A process that dies is a failure, told and kept.
Result<EngineEnd> run_local(const CampaignFile& file, const Store& store, const std::vector<PlannedTask>& plan,
                            const EngineSettings& settings);

/// Job arrays by sbatch --wait; what a dead node took with it is submitted again, three times at most. Arrays of this
/// campaign that are in the queue already are waited for. Ctrl-C cancels them.
Result<EngineEnd> run_slurm(const CampaignFile& file, const Store& store, const std::vector<PlannedTask>& plan,
                            const EngineSettings& settings);

}  // namespace prism::campaign
