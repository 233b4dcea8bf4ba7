// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/escape.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/campaign/cpu_level.hpp"
#include "tools/prismcal/campaign/executors.hpp"
#include "tools/prismcal/campaign/lot_report.hpp"
#include "tools/prismcal/campaign/model_installation.hpp"
#include "tools/prismcal/campaign/progress.hpp"
#include "tools/prismcal/campaign/task_command.hpp"
#include "tools/prismcal/campaign/task_run.hpp"
#include "tools/prismcal/commands/campaign_work.hpp"
#include "tools/prismcal/commands/commands.hpp"

namespace prism::commands {
namespace {

struct CampaignChoice {
  std::string file, engine = "local", task;
  campaign::ExecutorSettings settings;
  bool plan = false, status = false, collect = false;
  std::string install;
};

std::string program_path() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).string();
}

/// Prints recordings and gyros without a task, for a plan or a status.
void print_left_out(const std::vector<campaign::LeftOutInput>& left_out) {
  for (const campaign::LeftOutInput& input : left_out)
    fmt::print("left out: {}: {}\n", printable(input.what), printable(input.why));
}

Result<campaign::Plan> make_and_store_plan(const campaign::CampaignFile& file, const campaign::ResultStore& store) {
  if (auto made = store.create(); !made) return tl::unexpected<Error>(made.error());
  campaign::InputCache cache(store.file("inputs.cache"));
  auto plan = campaign::make_plan(file, campaign_work(store.file("calibration.json")), cache);
  if (!plan) return plan;
  if (auto saved = cache.save(); !saved) return tl::unexpected<Error>(saved.error());
  if (auto written = store.write_plan(*plan); !written) return tl::unexpected<Error>(written.error());
  return plan;
}

std::string state_of(const std::string& id, const std::unordered_set<std::string>& with_result) {
  return with_result.contains(id) ? "done" : "to do";
}

int print_plan(const campaign::Plan& plan, const campaign::ResultStore& store) {
  const auto with_result = store.with_result();
  double to_do_s = 0, max_mb = 0;
  std::size_t to_do = 0;
  fmt::print("{:<32}  {:<20}  {:<14}  {:>8}  {:>6}\n", "task", "gyro", "model", "CPU s", "MB");
  for (const campaign::Task& task : plan.tasks) {
    const bool has_result = with_result.contains(task.id);
    fmt::print("{}  {:<20}  {:<14}  {:>8.1f}  {:>6.0f}  {}\n", task.id, printable(task.gyro()),
               printable(task.model.name), task.cpu_s, task.memory_mb, state_of(task.id, with_result));
    if (!has_result) to_do_s += task.cpu_s;
    to_do += !has_result;
    max_mb = std::max(max_mb, task.memory_mb);
  }
  print_left_out(plan.left_out);
  fmt::print("{} tasks of {} gyros, {} to do: about {:.2f} CPU hours (all tasks {:.2f}), at most {:.0f} MB per task\n",
             plan.tasks.size(), plan.gyros, to_do, to_do_s / 3600, plan.cpu_s() / 3600, max_mb);
  return 0;
}

Result<int> print_status(const campaign::ResultStore& store) {
  const auto status = campaign::read_status(store);
  if (!status) return tl::unexpected<Error>(status.error());
  fmt::print("{} of {} tasks done, {} running, {} failed, {} waiting; about {:.2f} of {:.2f} CPU hours done\n",
             status->done, status->tasks, status->running, status->failed.size(), status->waiting,
             status->done_cpu_s / 3600, status->cpu_s / 3600);
  const double left_s = status->cpu_s - status->done_cpu_s;
  if (status->running > 0)
    fmt::print("time left: about {} with {} at a time\n",
               campaign::duration_text(left_s / static_cast<double>(status->running)), status->running);
  for (const campaign::TaskLine& line : status->refused)
    fmt::print("refused: {}, {}: {}\n", printable(line.gyro), printable(line.model), printable(line.why));
  for (const campaign::TaskLine& line : status->failed)
    fmt::print("failed: {}, {}: {}\n", printable(line.gyro), printable(line.model), printable(line.why));
  print_left_out(status->left_out);
  return status->failed.empty() ? 0 : 1;
}

/// Writes the report of the campaign and the accepted models.
Result<int> collect(const campaign::CampaignFile& file, const campaign::ResultStore& store) {
  const auto lot = campaign::read_lot(store, file.limits);
  if (!lot) return tl::unexpected<Error>(lot.error());
  std::optional<campaign::Lot> previous;
  if (!file.previous.empty()) {
    auto read = campaign::read_lot(campaign::ResultStore(file.previous), file.limits);
    if (!read) return make_error(file.path + ":/previous", read.error().text());
    previous = std::move(*read);
  }
  CommonOptions options;
  options.out = store.file("report");
  const auto report = campaign::lot_report(file, *lot, previous ? &*previous : nullptr);
  if (auto done = write_report(report, options); !done) return tl::unexpected<Error>(done.error());
  const auto accepted = campaign::install_models(file, store, *lot, store.file("accepted"), false);
  if (!accepted) return tl::unexpected<Error>(accepted.error());
  fmt::print("{}\naccepted models: {} in {}\n", printable(report.subtitle), accepted->models, store.file("accepted"));
  return lot->missing.empty() ? 0 : 1;
}

Result<int> install(const campaign::CampaignFile& file, const campaign::ResultStore& store, const std::string& folder) {
  const auto lot = campaign::read_lot(store, file.limits);
  if (!lot) return tl::unexpected<Error>(lot.error());
  const auto installed = campaign::install_models(file, store, *lot, folder, true);
  if (!installed) return tl::unexpected<Error>(installed.error());
  fmt::print("{} models installed in {}, {} models of other gyros kept; {} tasks without a result\n", installed->models,
             folder, installed->kept, lot->missing.size());
  return 0;
}

Result<int> run_one(const campaign::ResultStore& store, const std::string& id, char** argv) {
  const auto task = store.read_task(id);
  if (!task) return tl::unexpected<Error>(task.error());
  if (store.has_result(id)) return 0;
  if (auto level = campaign::run_at_level(task->level, argv); !level) {
    if (auto recorded = store.add_failure(id, level.error().text()); !recorded)
      return tl::unexpected<Error>(recorded.error());
    return tl::unexpected<Error>(level.error());
  }
  const auto done = campaign::run_task(store, *task, campaign_work(store.file("calibration.json")));
  if (!done) return tl::unexpected<Error>(done.error());
  return 0;
}

Result<int> run_engine(const CampaignChoice& choice, const campaign::CampaignFile& file,
                       const campaign::ResultStore& store) {
  const auto plan = make_and_store_plan(file, store);
  if (!plan) return tl::unexpected<Error>(plan.error());
  const auto planned = store.read_plan();
  if (!planned) return tl::unexpected<Error>(planned.error());
  const auto to_do = store.tasks_to_do(*planned);
  if (choice.engine == "print") {
    for (const campaign::PlannedTask& task : to_do)
      fmt::print("{}\n", campaign::task_command(file, choice.settings.program, task.id));
    return 0;
  }
  fmt::print(stderr, "prismcal: {} tasks of {} gyros, {} to do, {} done\n", planned->size(), plan->gyros, to_do.size(),
             planned->size() - to_do.size());
  const auto end = choice.engine == "slurm" ? campaign::run_slurm(file, store, *planned, choice.settings)
                                            : campaign::run_local(file, store, *planned, choice.settings);
  if (!end) return tl::unexpected<Error>(end.error());
  const std::string left = fmt::format("{} done, {} failed, {} left", end->done, end->failed, to_do.size() - end->done);
  if (end->interrupted) {
    fmt::print(stderr, "prismcal: interrupted: {}; repeat the command to continue\n", left);
    return kInterrupted;
  }
  fmt::print(stderr, "prismcal: {}\n", left);
  return end->failed == 0 ? 0 : 1;
}

Result<int> run_campaign(const CampaignChoice& choice, char** argv) {
  const auto file = campaign::load_campaign(choice.file);
  if (!file) return tl::unexpected<Error>(file.error());
  for (const std::string& warning : file->warnings) fmt::print(stderr, "prismcal: warning: {}\n", warning);
  const campaign::ResultStore store(file->folder);
  if (!choice.task.empty()) return run_one(store, choice.task, argv);
  if (choice.status) return print_status(store);
  if (choice.collect) return collect(*file, store);
  if (!choice.install.empty()) return install(*file, store, choice.install);
  if (!choice.plan) return run_engine(choice, *file, store);
  const auto plan = make_and_store_plan(*file, store);
  if (!plan) return tl::unexpected<Error>(plan.error());
  return print_plan(*plan, store);
}

}  // namespace

void add_campaign_command(CLI::App& app, int& code, char** argv) {
  CLI::App* command = app.add_subcommand(
      "campaign", "train and evaluate models of hundreds of gyros, on this machine's cores or on a cluster");
  const auto choice = std::make_shared<CampaignChoice>();
  command->add_option("file", choice->file, "campaign file (JSON): recordings, models, limits, output")->required();
  CLI::Option* plan = command->add_flag("--plan", choice->plan, "print the tasks and the expected CPU hours");
  CLI::Option* status = command->add_flag("--status", choice->status,
                                          "print the numbers of finished, running and failed tasks, and the time left");
  CLI::Option* task = command->add_option("--task", choice->task, "run only this task, as the engines do");
  CLI::Option* collected = command->add_flag(
      "--collect", choice->collect, "write the campaign's report (HTML, CSV, JSON) and the folder of accepted models");
  CLI::Option* installed =
      command->add_option("--install", choice->install, "install the accepted models in this folder, atomically");
  plan->excludes(status)->excludes(collected)->excludes(installed)->excludes(task);
  status->excludes(collected)->excludes(installed)->excludes(task);
  collected->excludes(installed)->excludes(task);
  installed->excludes(task);
  command
      ->add_option("--engine", choice->engine,
                   "local (default), slurm (a job array) or print (one shell command per task)")
      ->check(CLI::IsMember({"local", "slurm", "print"}));
  command->add_option("--jobs", choice->settings.jobs, "local: concurrent tasks (default: one per core)")
      ->check(tools::within(1, 1024));
  command
      ->add_option("--memory", choice->settings.memory_mb,
                   "local: memory limit of all running tasks, MB (default: 80 % of the free memory)")
      ->check(tools::positive());
  command->add_flag("--detach", choice->settings.detach, "slurm: submit and return; see --status for the progress");
  tools::add_examples(
      *command, {"prismcal campaign lot.json --plan", "prismcal campaign lot.json",
                 "prismcal campaign lot.json --collect", "prismcal campaign lot.json --install /srv/models",
                 "prismcal campaign lot.json --engine slurm --detach", "prismcal campaign lot.json --engine print"});
  command->callback([choice, &code, argv] {
    choice->settings.program = program_path();
    const auto done = run_campaign(*choice, argv);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
