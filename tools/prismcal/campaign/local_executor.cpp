// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstring>
#include <list>
#include <map>
#include <sstream>
#include <thread>

#include "base/file.hpp"
#include "tools/prismcal/campaign/child_process.hpp"
#include "tools/prismcal/campaign/executors.hpp"
#include "tools/prismcal/campaign/progress.hpp"
#include "tools/prismcal/campaign/signals.hpp"

namespace prism::campaign {
namespace {

constexpr double kShareOfFreeMemory = 0.8;

double free_memory_mb() {
  std::istringstream in(read_text_file("/proc/meminfo").value_or(""));
  for (std::string word; in >> word;) {
    double kib = 0;
    if (word == "MemAvailable:" && in >> kib) return kib / 1024;
  }
  return 1000;
}

class ProcessPool {
 public:
  ProcessPool(const CampaignFile& file, const ResultStore& store, const ExecutorSettings& settings,
              const std::vector<PlannedTask>& to_do, std::size_t planned)
      : file_(file),
        store_(store),
        settings_(settings),
        waiting_(to_do.begin(), to_do.end()),
        progress_(planned, to_do) {
    if (settings_.jobs <= 0) settings_.jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    if (settings_.memory_mb <= 0) settings_.memory_mb = kShareOfFreeMemory * free_memory_mb();
  }
  ProcessPool(const ProcessPool&) = delete;
  ProcessPool& operator=(const ProcessPool&) = delete;
  ~ProcessPool() {
    for (const auto& [child, task] : running_) ::kill(-child, SIGKILL);
    for (const auto& [child, task] : running_) {
      ::waitpid(child, nullptr, 0);
      store_.clear_running(task.id);
    }
    store_.sweep();
  }

  Result<ExecutorResult> run() {
    while (!waiting_.empty() || !running_.empty()) {
      for (auto next = waiting_.end(); (next = next_that_fits()) != waiting_.end();) {
        if (auto started = start(next); !started) return tl::unexpected<Error>(started.error());
      }
      end_.interrupted = signals_.wait_for_stop(1);
      if (end_.interrupted) break;
      reap();
      progress_.show(end_.done, running_.size(), end_.failed, done_cpu_s_);
    }
    return end_;
  }

 private:
  using Waiting = std::list<PlannedTask>;

  Waiting::iterator next_that_fits() {
    if (static_cast<int>(running_.size()) >= settings_.jobs) return waiting_.end();
    return std::find_if(waiting_.begin(), waiting_.end(), [this](const PlannedTask& task) {
      return running_.empty() || used_mb_ + task.memory_mb <= settings_.memory_mb;
    });
  }

  Result<void> start(Waiting::iterator next) {
    const auto child = start_program(
        // setpriv kills the task when this program ends, even if this program is killed
        {"setpriv", "--pdeathsig", "KILL", settings_.program, "campaign", file_.path, "--task", next->id},
        store_.file("output.txt"));
    if (!child) return tl::unexpected<Error>(child.error());
    used_mb_ += next->memory_mb;
    running_.emplace(*child, *next);
    waiting_.erase(next);
    return {};
  }

  void reap() {
    int status = 0;
    for (pid_t child = 0; (child = ::waitpid(-1, &status, WNOHANG)) > 0;) {
      const auto found = running_.find(child);
      if (found == running_.end()) continue;
      const PlannedTask task = std::move(found->second);
      running_.erase(found);
      used_mb_ -= task.memory_mb;
      if (store_.has_result(task.id)) {
        ++end_.done;
        done_cpu_s_ += task.cpu_s;
      } else {
        record_failure(task, status);
      }
    }
  }

  void record_failure(const PlannedTask& task, int status) {
    ++end_.failed;
    store_.clear_running(task.id);
    const auto failures = store_.failures();
    const auto known = failures.find(task.id);
    std::string why;
    if (WIFSIGNALED(status)) {
      why = fmt::format("ended by signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)));
    } else if (known != failures.end()) {
      why = known->second.why;
    } else {
      why = fmt::format("ended with status {} and no message; see its output in {}", WEXITSTATUS(status),
                        store_.file("output.txt"));
    }
    if (WIFSIGNALED(status) || known == failures.end())
      (void)store_.add_failure(task.id, why);  // the line below is printed anyway
    progress_.print(fmt::format("{}, {}: {}", task.gyro, task.model, why));
  }

  const CampaignFile& file_;
  const ResultStore& store_;
  ExecutorSettings settings_;
  Waiting waiting_;
  std::map<pid_t, PlannedTask> running_;
  WatchedSignals signals_;
  Progress progress_;
  ExecutorResult end_;
  double used_mb_ = 0, done_cpu_s_ = 0;
};

}  // namespace

Result<ExecutorResult> run_local(const CampaignFile& file, const ResultStore& store,
                                 const std::vector<PlannedTask>& plan, const ExecutorSettings& settings) {
  store.sweep();
  return ProcessPool(file, store, settings, store.tasks_to_do(plan), plan.size()).run();
}

}  // namespace prism::campaign
