// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>

#include "base/file.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/campaign/engines.hpp"
#include "tools/prismcal/campaign/progress.hpp"
#include "tools/prismcal/campaign/signals.hpp"

namespace prism::campaign {
namespace {

constexpr int kRounds = 3;                // a task that three nodes lost is a failure
constexpr std::size_t kArrayMost = 1000;  // elements; Slurm's preset of MaxArraySize is 1001
constexpr double kElement_s =
    20;  // CPU seconds of an element at least, where the tasks are short: launching takes its time
constexpr std::size_t kElementsLeast = 32;  // but so many elements, so that all nodes have work to the end

/// The arrays of one campaign folder are known by their name.
std::string job_name(const Store& store) { return "prism-" + sha256_hex(store.folder()).substr(0, 12); }

/// What a command prints; nothing where it fails.
std::optional<std::string> output_of(const std::string& command) {
  std::FILE* pipe = ::popen((command + " 2>/dev/null").c_str(), "r");
  if (!pipe) return std::nullopt;
  std::string text;
  char piece[4096];
  for (std::size_t got = 0; (got = std::fread(piece, 1, sizeof piece, pipe)) > 0;) text.append(piece, got);
  return ::pclose(pipe) == 0 ? std::optional(text) : std::nullopt;
}

/// Elements of this campaign's arrays that wait or run; nothing where Slurm does not answer.
std::optional<std::size_t> queued(const Store& store) {
  const auto lines = output_of("squeue -h -r -o %i -n " + job_name(store));
  if (!lines) return std::nullopt;
  return static_cast<std::size_t>(std::count(lines->begin(), lines->end(), '\n'));
}

/// Lines of task ids, one line an array element: of tasks so many that an element is worth its launch.
std::vector<std::string> elements_of(const std::vector<PlannedTask>& tasks) {
  double all_s = 0;
  for (const PlannedTask& task : tasks) all_s += task.cpu_s;
  const double element_s = std::min(kElement_s, all_s / static_cast<double>(kElementsLeast));
  std::vector<std::string> lines;
  double sum_s = element_s;
  for (const PlannedTask& task : tasks) {
    if (sum_s >= element_s) {
      lines.emplace_back();
      sum_s = 0;
    }
    lines.back() += (lines.back().empty() ? "" : " ") + task.id;
    sum_s += task.cpu_s;
  }
  return lines;
}

std::string script_of(const CampaignFile& file, const Store& store, const EngineSettings& settings,
                      const std::string& list) {
  return fmt::format(
      "#!/bin/sh\n#SBATCH --job-name={}\n#SBATCH {} --open-mode=append\n"
      "#SBATCH --ntasks=1 --cpus-per-task=1\ncode=0\nfor id in $(sed -n \"${{SLURM_ARRAY_TASK_ID}}p\" {}); do\n"
      "  {} campaign {} --task \"$id\" || code=1\ndone\nexit $code\n",
      // Slurm holds what it requeues for two minutes; who waits submits it again at once.
      job_name(store), settings.detach ? "--requeue" : "--no-requeue", shell_quoted(list),
      shell_quoted(settings.program), shell_quoted(file.path));
}

/// sbatch as a child that ends with us; what it submitted stays.
pid_t submit(const std::vector<std::string>& words, const std::string& output) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::setpgid(0, 0);
  WatchedSignals::release();
  const int out = ::open(output.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666);
  if (out >= 0) ::dup2(out, STDOUT_FILENO), ::dup2(out, STDERR_FILENO);
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  ::execvp(argv[0], argv.data());
  ::_exit(127);
}

class SlurmRun {
 public:
  SlurmRun(const CampaignFile& file, const Store& store, const std::vector<PlannedTask>& plan,
           const EngineSettings& settings)
      : file_(file),
        store_(store),
        plan_(plan),
        settings_(settings),
        to_do_(tasks_to_do(store, plan)),
        progress_(plan.size(), plan.size() - to_do_.size(), total_s(to_do_)) {}

  Result<EngineEnd> run() {
    const auto before = queued(store_);
    if (!before) return refuse("squeue", "does not answer; expected a Slurm that this machine can submit to");
    wanted_ = to_do_.size();
    if (*before > 0) {
      progress_.say(fmt::format("{} elements of this campaign are in the queue already", *before));
      if (settings_.detach) return end();
      if (!wait_for_queue()) return interrupt();
    }
    for (int round = 1; round <= kRounds; ++round) {
      const auto left = lost_or_new();
      if (left.empty()) break;
      if (round > 1) progress_.say(fmt::format("{} tasks were lost with their nodes: submitted again", left.size()));
      if (auto done = submit_all(left); !done) return tl::unexpected<Error>(done.error());
      if (settings_.detach) return end();
      if (!wait_for_queue()) return interrupt();
    }
    for (const PlannedTask& task : lost_or_new()) {
      if (auto kept = store_.add_failure(task.id, fmt::format("lost {} times: no node finished it", kRounds)); !kept)
        return tl::unexpected<Error>(kept.error());
    }
    return end();
  }

 private:
  static double total_s(const std::vector<PlannedTask>& tasks) {
    double sum = 0;
    for (const PlannedTask& task : tasks) sum += task.cpu_s;
    return sum;
  }

  /// Tasks that neither stand nor failed since this run began: each is tried again once a run.
  std::vector<PlannedTask> lost_or_new() const {
    auto left = tasks_to_do(store_, plan_);
    const auto failures = store_.failures();
    std::erase_if(left, [&](const PlannedTask& task) {
      const auto found = failures.find(task.id);
      const auto old = old_failures_.find(task.id);
      return found != failures.end() && (old == old_failures_.end() || old->second.attempts != found->second.attempts);
    });
    return left;
  }

  Result<void> submit_all(const std::vector<PlannedTask>& tasks) {
    std::error_code error;
    std::filesystem::create_directories(store_.file("slurm"), error);
    const auto lines = elements_of(tasks);
    for (std::size_t begin = 0; begin < lines.size(); begin += kArrayMost) {
      const std::size_t count = std::min(kArrayMost, lines.size() - begin);
      std::string list;
      for (std::size_t i = begin; i < begin + count; ++i) list += lines[i] + "\n";
      const std::string base = store_.file("slurm/" + sha256_hex(list).substr(0, 16));
      if (auto done = write_text_file(base + ".list", list); !done) return done;
      if (auto done = write_text_file(base + ".sh", script_of(file_, store_, settings_, base + ".list")); !done)
        return done;
      if (auto done = submit_one(base + ".sh", count); !done) return done;
    }
    return {};
  }

  Result<void> submit_one(const std::string& script, std::size_t count) {
    std::vector<std::string> words = {"sbatch", "--parsable", fmt::format("--array=1-{}", count),
                                      "--output=" + store_.file("slurm") + "/%A_%a.txt"};  // a path may have blanks
    if (!settings_.detach) words.emplace_back("--wait");
    words.insert(words.end(), file_.slurm_options.begin(), file_.slurm_options.end());
    words.push_back(script);
    const std::string output = store_.file("slurm/sbatch.txt");
    const pid_t child = submit(words, output);
    if (child < 0) return refuse("sbatch", "cannot be begun");
    if (!settings_.detach) {
      waiting_.push_back(child);
      return {};
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    if (status != 0) return refuse("sbatch", "refused the job; its words are at the end of " + output);
    return {};
  }

  /// Until every sbatch --wait has ended, or every task has; and the queue is empty. False: Ctrl-C.
  bool wait_for_queue() {
    for (int turn = 1;; ++turn) {
      const int signal = signals_.wait(500);
      if (signal == SIGINT || signal == SIGTERM) return false;
      std::erase_if(waiting_, [](pid_t child) { return ::waitpid(child, nullptr, WNOHANG) != 0; });
      const std::size_t left = lost_or_new().size();
      show();
      if (left == 0) break;
      // Beside sbatch, the queue is asked: arrays of an earlier run have no sbatch that waits for them.
      if (waiting_.empty() && turn % 4 == 0 && queued(store_).value_or(1) == 0) break;
    }
    for (const pid_t child : waiting_) ::kill(child, SIGKILL), ::waitpid(child, nullptr, 0);
    waiting_.clear();
    return true;
  }

  void show() {
    const auto status = read_status(store_, false);
    if (status)
      progress_.show(status->done, status->running, status->failed.size(),
                     std::max(0.0, status->done_cpu_s - (status->cpu_s - total_s(to_do_))));
  }

  Result<EngineEnd> interrupt() {
    (void)output_of("scancel -n " + job_name(store_));
    for (const pid_t child : waiting_) ::kill(child, SIGKILL), ::waitpid(child, nullptr, 0);
    auto ended = end();
    ended->interrupted = true;
    return ended;
  }

  Result<EngineEnd> end() {
    EngineEnd ended;
    const std::size_t left = tasks_to_do(store_, plan_).size();
    ended.done = wanted_ - left;
    ended.failed = left - lost_or_new().size();
    return ended;
  }

  const CampaignFile& file_;
  const Store& store_;
  const std::vector<PlannedTask>& plan_;
  const EngineSettings& settings_;
  std::vector<PlannedTask> to_do_;
  std::unordered_map<std::string, Failure> old_failures_ = store_.failures();
  std::vector<pid_t> waiting_;
  WatchedSignals signals_;
  Progress progress_;
  std::size_t wanted_ = 0;
};

}  // namespace

Result<EngineEnd> run_slurm(const CampaignFile& file, const Store& store, const std::vector<PlannedTask>& plan,
                            const EngineSettings& settings) {
  auto ended = SlurmRun(file, store, plan, settings).run();
  store.sweep();
  return ended;
}

}  // namespace prism::campaign
