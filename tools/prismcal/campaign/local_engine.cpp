// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <list>
#include <map>
#include <sstream>
#include <thread>

#include "base/file.hpp"
#include "tools/prismcal/campaign/engines.hpp"
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

/// In a process group of its own, so that a Ctrl-C on the terminal is ours to hand on; it ends when we do.
pid_t spawn(const CampaignFile& file, const EngineSettings& settings, const std::string& id,
            const std::string& output) {
  const pid_t parent = ::getpid(), child = ::fork();
  if (child != 0) {
    if (child > 0) ::setpgid(child, child);  // whoever is first, it or we
    return child;
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  ::setpgid(0, 0);
  WatchedSignals::release();
  const int none = ::open("/dev/null", O_RDONLY), out = ::open(output.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666);
  ::dup2(none, STDIN_FILENO);
  if (out >= 0) ::dup2(out, STDOUT_FILENO), ::dup2(out, STDERR_FILENO);
  ::execl(settings.program.c_str(), settings.program.c_str(), "campaign", file.path.c_str(), "--task", id.c_str(),
          static_cast<char*>(nullptr));
  ::_exit(127);
}

class LocalRun {
 public:
  LocalRun(const CampaignFile& file, const Store& store, const EngineSettings& settings, std::vector<PlannedTask> to_do,
           std::size_t planned)
      : file_(file),
        store_(store),
        settings_(settings),
        to_do_(to_do.begin(), to_do.end()),
        progress_(planned, planned - to_do.size(), total_s(to_do)),
        stood_(planned - to_do.size()) {
    if (settings_.jobs <= 0) settings_.jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    if (settings_.memory_mb <= 0) settings_.memory_mb = kShareOfFreeMemory * free_memory_mb();
  }

  Result<EngineEnd> run() {
    while (!to_do_.empty() || !running_.empty()) {
      while (begin_next()) {
      }
      if (failed_to_fork_) return refuse("fork", std::strerror(failed_to_fork_));
      switch (signals_.wait(1000)) {
        case SIGINT:
        case SIGTERM:
          stop();
          end_.interrupted = true;
          return end_;
        default:
          reap();
      }
      progress_.show(stood_ + end_.done, running_.size(), end_.failed, done_s_);
    }
    store_.sweep();  // of tasks whose process was killed
    return end_;
  }

 private:
  static double total_s(const std::vector<PlannedTask>& tasks) {
    double sum = 0;
    for (const PlannedTask& task : tasks) sum += task.cpu_s;
    return sum;
  }

  /// The longest task that fits beside those that run; any one where none runs.
  bool begin_next() {
    if (static_cast<int>(running_.size()) >= settings_.jobs) return false;
    const auto fits = [&](const PlannedTask& task) {
      return running_.empty() || used_mb_ + task.memory_mb <= settings_.memory_mb;
    };
    const auto next = std::find_if(to_do_.begin(), to_do_.end(), fits);
    if (next == to_do_.end()) return false;
    const pid_t child = spawn(file_, settings_, next->id, store_.file("output.txt"));
    if (child < 0) {
      failed_to_fork_ = errno;
      stop();
      return false;
    }
    used_mb_ += next->memory_mb;
    running_.emplace(child, *next);
    to_do_.erase(next);
    return true;
  }

  void reap() {
    int status = 0;
    for (pid_t child = 0; (child = ::waitpid(-1, &status, WNOHANG)) > 0;) {
      const auto found = running_.find(child);
      if (found == running_.end()) continue;
      end_one(found->second, status);
      used_mb_ -= found->second.memory_mb;
      running_.erase(found);
    }
  }

  void end_one(const PlannedTask& task, int status) {
    if (store_.stands(task.id)) {
      ++end_.done;
      done_s_ += task.cpu_s;
      return;
    }
    ++end_.failed;
    store_.clear_running(task.id);
    std::string why;
    if (WIFSIGNALED(status)) {
      why = fmt::format("ended by signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)));
    } else if (const auto failures = store_.failures(); failures.contains(task.id)) {
      progress_.say(fmt::format("{}, {}: {}", task.gyro, task.model, failures.at(task.id).why));
      return;
    } else {
      why = fmt::format("ended with {} and said nothing; {} has its words", WEXITSTATUS(status),
                        store_.file("output.txt"));
    }
    (void)store_.add_failure(task.id, why);  // what the disk refuses is told below all the same
    progress_.say(fmt::format("{}, {}: {}", task.gyro, task.model, why));
  }

  void stop() {
    for (const auto& [child, task] : running_) ::kill(-child, SIGKILL);
    for (const auto& [child, task] : running_) {
      ::waitpid(child, nullptr, 0);
      store_.clear_running(task.id);
    }
    running_.clear();
    store_.sweep();
  }

  const CampaignFile& file_;
  const Store& store_;
  EngineSettings settings_;
  std::list<PlannedTask> to_do_;
  std::map<pid_t, PlannedTask> running_;
  WatchedSignals signals_;
  Progress progress_;
  EngineEnd end_;
  std::size_t stood_;
  double used_mb_ = 0, done_s_ = 0;
  int failed_to_fork_ = 0;
};

}  // namespace

std::vector<PlannedTask> tasks_to_do(const Store& store, const std::vector<PlannedTask>& plan) {
  const auto standing = store.standing();
  std::vector<PlannedTask> tasks;
  std::copy_if(plan.begin(), plan.end(), std::back_inserter(tasks),
               [&](const PlannedTask& task) { return !standing.contains(task.id); });
  std::stable_sort(tasks.begin(), tasks.end(),
                   [](const PlannedTask& a, const PlannedTask& b) { return a.cpu_s > b.cpu_s; });
  return tasks;
}

std::string shell_quoted(const std::string& text) {
  if (!text.empty() &&
      text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%") ==
          std::string::npos)
    return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string task_command(const CampaignFile& file, const EngineSettings& settings, const std::string& id) {
  return fmt::format("{} campaign {} --task {}", shell_quoted(settings.program), shell_quoted(file.path), id);
}

Result<EngineEnd> run_local(const CampaignFile& file, const Store& store, const std::vector<PlannedTask>& plan,
                            const EngineSettings& settings) {
  store.sweep();
  return LocalRun(file, store, settings, tasks_to_do(store, plan), plan.size()).run();
}

}  // namespace prism::campaign
