// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <numeric>

namespace prism::campaign {

Result<Status> read_status(const ResultStore& store, bool refusals) {
  const auto plan = store.read_plan();
  if (!plan) return tl::unexpected<Error>(plan.error());
  const auto with_result = store.with_result();
  const auto failures = store.failures();
  const auto running = store.running();
  Status status;
  status.tasks = plan->size();
  status.left_out = store.read_left_out();
  for (const PlannedTask& task : *plan) {
    status.cpu_s += task.cpu_s;
    if (with_result.contains(task.id)) {
      ++status.done;
      status.done_cpu_s += task.cpu_s;
      std::string why = refusals ? store.refusal(task.id) : std::string();
      if (!why.empty()) status.refused.push_back({task.gyro, task.model, std::move(why)});
    } else if (running.contains(task.id)) {
      ++status.running;
    } else if (const auto failed = failures.find(task.id); failed != failures.end()) {
      status.failed.push_back({task.gyro, task.model,
                               failed->second.attempts > 1
                                   ? fmt::format("{} ({} times)", failed->second.why, failed->second.attempts)
                                   : failed->second.why});
    } else {
      ++status.waiting;
    }
  }
  return status;
}

std::string duration_text(double s) {
  const auto rounded = static_cast<long>(s + 0.5);
  if (rounded < 100) return fmt::format("{} s", rounded);
  if (rounded < 5400) return fmt::format("{} min {:02} s", rounded / 60, rounded % 60);
  return fmt::format("{} h {:02} min", rounded / 3600, rounded / 60 % 60);
}

double total_cpu_s(const std::vector<PlannedTask>& tasks) {
  return std::accumulate(tasks.begin(), tasks.end(), 0.0,
                         [](double sum, const PlannedTask& task) { return sum + task.cpu_s; });
}

Progress::Progress(std::size_t planned, const std::vector<PlannedTask>& to_do)
    : planned_(planned),
      done_before_(planned - to_do.size()),
      to_do_cpu_s_(total_cpu_s(to_do)),
      terminal_(::isatty(STDERR_FILENO) != 0) {
  show(0, 0, 0, 0);
}

Progress::~Progress() {
  if (drawn_) fmt::print(stderr, "\n");
}

void Progress::show(std::size_t done, std::size_t running, std::size_t failed, double done_cpu_s) {
  if (!terminal_) return;
  constexpr std::size_t kWidth = 30;
  done += done_before_;
  const std::size_t filled = planned_ > 0 ? kWidth * std::min(done, planned_) / planned_ : kWidth;
  const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  const std::string left =
      done_cpu_s > 0 ? duration_text(elapsed_s * std::max(0.0, to_do_cpu_s_ - done_cpu_s) / done_cpu_s) + " left" : "";
  fmt::print(stderr, "\r[{:#<{}}{:{}}] {} of {} done, {} running{} {:<20}", "", filled, "", kWidth - filled, done,
             planned_, running, failed > 0 ? fmt::format(", {} failed", failed) : "", left);
  std::fflush(stderr);
  drawn_ = true;
}

void Progress::print(const std::string& line) {
  fmt::print(stderr, "{}prismcal: {}\n", drawn_ ? "\r\033[K" : "", line);
}

}  // namespace prism::campaign
