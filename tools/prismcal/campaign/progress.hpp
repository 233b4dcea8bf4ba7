// SPDX-License-Identifier: MIT
// Progress of a campaign: counts, time left, a bar on a terminal.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "tools/prismcal/campaign/result_store.hpp"

namespace prism::campaign {

struct Status {
  std::size_t tasks = 0, done = 0, running = 0, waiting = 0;
  double cpu_s = 0, done_cpu_s = 0;  ///< as planned
  std::vector<TaskLine> refused;     ///< done: the training refused them, and says why
  std::vector<TaskLine> failed;      ///< to be tried again
  std::vector<LeftOutInput> left_out;
};

/// Reads the store; `refusals` false leaves `refused` empty. Errors: no plan.
Result<Status> read_status(const ResultStore& store, bool refusals = true);

/// "2 h 05 min", "12 s".
std::string duration_text(double s);

double total_cpu_s(const std::vector<PlannedTask>& tasks);

/// Progress bar of a run, on terminals only.
class Progress {
 public:
  /// `planned`: tasks in the plan; `to_do`: those of them without a result.
  Progress(std::size_t planned, const std::vector<PlannedTask>& to_do);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Counts of the tasks to do.
  void show(std::size_t done, std::size_t running, std::size_t failed, double done_cpu_s);
  /// Prints a line above the bar, on stderr.
  void print(const std::string& line);

 private:
  std::size_t planned_, done_before_;
  double to_do_cpu_s_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  bool terminal_, drawn_ = false;
};

}  // namespace prism::campaign
