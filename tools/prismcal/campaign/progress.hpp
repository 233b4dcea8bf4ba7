// SPDX-License-Identifier: MIT
// Progress of a campaign: counts, time left, and a progress bar.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "tools/prismcal/campaign/result_store.hpp"

namespace prism::campaign {

struct Status {
  std::size_t tasks = 0, done = 0, running = 0, waiting = 0;
  double cpu_s = 0, done_cpu_s = 0;  ///< estimates from the plan
  std::vector<TaskLine> refused;     ///< among the done ones: tasks whose data training rejected, with the reason
  std::vector<TaskLine> failed;      ///< the next run retries them
  std::vector<LeftOutInput> left_out;
};

/// Reads the store. Leaves `refused` empty if `refusals` is false, which is faster. Errors: no plan.
Result<Status> read_status(const ResultStore& store, bool refusals = true);

/// "2 h 05 min", "12 s".
std::string duration_text(double s);

double total_cpu_s(const std::vector<PlannedTask>& tasks);

/// Draws a progress bar on stderr, if it is a terminal.
class Progress {
 public:
  /// `planned`: number of tasks in the plan; `to_do`: the tasks without a result.
  Progress(std::size_t planned, const std::vector<PlannedTask>& to_do);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Redraws the bar. All arguments count only tasks of `to_do`.
  void show(std::size_t done, std::size_t running, std::size_t failed, double done_cpu_s);
  /// Prints a line on stderr, above the bar.
  void print(const std::string& line);

 private:
  std::size_t planned_, done_before_;
  double to_do_cpu_s_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  bool terminal_, drawn_ = false;
};

}  // namespace prism::campaign
