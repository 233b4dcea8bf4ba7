// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <unordered_map>

#include "base/file.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/campaign/child_process.hpp"
#include "tools/prismcal/campaign/executors.hpp"
#include "tools/prismcal/campaign/progress.hpp"
#include "tools/prismcal/campaign/signals.hpp"
#include "tools/prismcal/campaign/task_command.hpp"

namespace prism::campaign {
namespace {

constexpr double kMaxElements = 1000;  // Slurm's default of MaxArraySize is 1001
constexpr double kMinElements = 32;    // enough to keep all nodes busy to the end
constexpr double kElement_cpu_s =
    20;  // above kMinElements: CPU seconds of an element, so that starting it costs little
constexpr int kPoll_s = 2;

class SlurmRun {
 public:
  SlurmRun(const CampaignFile& file, const ResultStore& store, const std::vector<PlannedTask>& plan,
           const ExecutorSettings& settings)
      : file_(file),
        store_(store),
        settings_(settings),
        to_do_(store.tasks_to_do(plan)),
        progress_(plan.size(), to_do_) {}

  Result<ExecutorResult> run() {
    std::error_code error;
    std::filesystem::create_directories(store_.file("slurm"), error);
    const auto before = queued();
    if (!before)
      return make_error("squeue",
                        before.error().what + "; expected a Slurm cluster that accepts jobs from this machine");
    if (*before > 0) {
      progress_.print(fmt::format("{} elements of this campaign are already in the queue", *before));
      if (settings_.detach) return end_of(state());
      if (!wait_for_queue()) return interrupt();
    }
    if (const auto tasks = state().left; !tasks.empty()) {
      if (auto done = submit(tasks); !done) return tl::unexpected<Error>(done.error());
      if (settings_.detach) return end_of(state());
      if (!wait_for_queue()) return interrupt();
    }
    for (const PlannedTask& task : state().left) {
      if (auto recorded =
              store_.add_failure(task.id, "left Slurm's queue without a result; see " + store_.file("slurm"));
          !recorded)
        return tl::unexpected<Error>(recorded.error());
    }
    return end_of(state());
  }

 private:
  struct State {
    std::vector<PlannedTask> left;  ///< neither done nor failed in this run
    std::size_t done = 0, failed = 0, running = 0;
    double done_cpu_s = 0;
  };

  State state() const {
    const auto with_result = store_.with_result();
    const auto running = store_.running();
    const auto failures = store_.failures();
    State state;
    for (const PlannedTask& task : to_do_) {
      const auto failed = failures.find(task.id), before = old_failures_.find(task.id);
      if (with_result.contains(task.id)) {
        ++state.done;
        state.done_cpu_s += task.cpu_s;
      } else if (failed != failures.end() &&
                 failed->second.attempts > (before == old_failures_.end() ? 0 : before->second.attempts)) {
        ++state.failed;
      } else {
        state.running += running.contains(task.id);
        state.left.push_back(task);
      }
    }
    return state;
  }

  static ExecutorResult end_of(const State& state) { return {false, state.done, state.failed}; }

  Result<std::string> slurm(const std::vector<std::string>& words) const {
    return output_of(words, store_.file("slurm/errors.txt"));
  }

  /// Number of pending and running elements of this campaign's array.
  Result<std::size_t> queued() const {
    const auto lines = slurm({"squeue", "-h", "-r", "-o", "%i", "-n", job_name_});
    if (!lines) return tl::unexpected<Error>(lines.error());
    return static_cast<std::size_t>(std::count(lines->begin(), lines->end(), '\n'));
  }

  /// Element k of n runs every n-th task starting at the k-th, so that each element gets long and short tasks.
  Result<void> submit(const std::vector<PlannedTask>& tasks) const {
    const double enough = std::clamp(total_cpu_s(tasks) / kElement_cpu_s, kMinElements, kMaxElements);
    const std::size_t elements = std::min(tasks.size(), static_cast<std::size_t>(enough));
    std::string ids;
    for (const PlannedTask& task : tasks) ids += task.id + "\n";
    const std::string script = store_.file("slurm/job.sh");
    auto done = write_text_file(
        script,
        fmt::format("#!/bin/sh\ncode=0\nfor id in $(sed -n \"${{SLURM_ARRAY_TASK_ID}}~{}p\" <<'END'\n{}END\n); do\n"
                    "  {} || code=1\ndone\nexit $code\n",
                    elements, ids, task_command(file_, settings_.program, "\"$id\"")));
    if (!done) return done;
    std::vector<std::string> words = {"sbatch",
                                      "--job-name=" + job_name_,
                                      fmt::format("--array=1-{}", elements),
                                      "--ntasks=1",
                                      "--cpus-per-task=1",
                                      "--requeue",
                                      "--open-mode=append",
                                      "--output=" + store_.file("slurm") + "/%A_%a.txt"};
    words.insert(words.end(), file_.slurm_options.begin(), file_.slurm_options.end());
    words.push_back(script);
    const auto submitted = slurm(words);
    return submitted ? Result<void>() : tl::unexpected<Error>(submitted.error());
  }

  /// Waits until all tasks are done or failed, or the queue has no more elements. Returns false after Ctrl-C.
  bool wait_for_queue() {
    for (;;) {
      if (signals_.wait_for_stop(kPoll_s)) return false;
      const std::size_t elements =
          queued().value_or(1);  // query before state(): an element that ends in between is then counted
      const State now = state();
      progress_.show(now.done, now.running, now.failed, now.done_cpu_s);
      if (now.left.empty() || elements == 0) return true;
    }
  }

  ExecutorResult interrupt() const {
    (void)slurm({"scancel", "-n", job_name_});
    ExecutorResult end = end_of(state());
    end.interrupted = true;
    return end;
  }

  const CampaignFile& file_;
  const ResultStore& store_;
  const ExecutorSettings& settings_;
  std::vector<PlannedTask> to_do_;
  std::unordered_map<std::string, Failure> old_failures_ = store_.failures();
  std::string job_name_ = "prism-" + sha256_hex(store_.folder()).substr(0, 12);
  WatchedSignals signals_;
  Progress progress_;
};

}  // namespace

Result<ExecutorResult> run_slurm(const CampaignFile& file, const ResultStore& store,
                                 const std::vector<PlannedTask>& plan, const ExecutorSettings& settings) {
  auto end = SlurmRun(file, store, plan, settings).run();
  store.sweep();
  return end;
}

}  // namespace prism::campaign
