// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/escape.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/campaign/lot_report.hpp"
#include "tools/prismcal/campaign/model_installation.hpp"
#include "tools/prismcal/campaign/task_run.hpp"
#include "tools/prismcal/commands/campaign_work.hpp"
#include "tools/prismcal/commands/commands.hpp"

namespace prism::commands {
namespace {

struct CampaignChoice {
  std::string file, engine, task;
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
  store.sweep();
  auto plan = campaign::make_plan(file, campaign_work());
  if (!plan) return plan;
  if (auto written = store.write_plan(*plan); !written) return tl::unexpected<Error>(written.error());
  return plan;
}

int print_plan(const campaign::Plan& plan, const campaign::ResultStore& store) {
  const auto with_result = store.with_result();
  std::size_t to_do = 0;
  fmt::print("{:<32}  {:<20}  {:<14}\n", "task", "gyro", "model");
  for (const campaign::Task& task : plan.tasks) {
    const bool has_result = with_result.contains(task.id);
    fmt::print("{}  {:<20}  {:<14}  {}\n", task.id, printable(task.gyro()), printable(task.model.name),
               has_result ? "done" : "to do");
    to_do += !has_result;
  }
  print_left_out(plan.left_out);
  fmt::print("{} tasks of {} gyros, {} to do\n", plan.tasks.size(), plan.gyros, to_do);
  return 0;
}

/// One shell command for each task without a result: it needs nothing but the directories and this program.
Result<int> print_commands(const campaign::CampaignFile& file, const campaign::ResultStore& store) {
  const auto planned = store.read_plan();
  if (!planned) return tl::unexpected<Error>(planned.error());
  for (const campaign::PlannedTask& task : store.tasks_to_do(*planned))
    fmt::print("{} campaign {} --task {}\n", shell_word(program_path()), shell_word(file.path), task.id);
  return 0;
}

Result<int> print_status(const campaign::ResultStore& store) {
  const auto status = campaign::read_status(store);
  if (!status) return tl::unexpected<Error>(status.error());
  fmt::print("{} of {} tasks done, {} failed, {} without a result yet\n", status->done, status->tasks,
             status->failed.size(), status->waiting);
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
  if (!report.warning.empty()) fmt::print(stderr, "prismcal: {}\n", printable(report.warning));
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

Result<int> run_one(const campaign::ResultStore& store, const std::string& id) {
  const auto task = store.read_task(id);
  if (!task) return tl::unexpected<Error>(task.error());
  const auto done = campaign::run_task(store, *task, campaign_work());
  if (!done) return tl::unexpected<Error>(done.error());
  return 0;
}

Result<int> run_campaign(const CampaignChoice& choice) {
  const auto file = campaign::load_campaign(choice.file);
  if (!file) {
    constexpr int kExitConfig = 78;  // as the other programs with a file that they cannot use
    fmt::print(stderr, "prismcal: {}\n", printable(file.error().text()));
    return kExitConfig;
  }
  for (const std::string& warning : file->warnings) fmt::print(stderr, "prismcal: warning: {}\n", warning);
  const campaign::ResultStore store(file->folder);
  if (!choice.task.empty()) return run_one(store, choice.task);
  if (choice.status) return print_status(store);
  if (choice.collect) return collect(*file, store);
  if (!choice.install.empty()) return install(*file, store, choice.install);
  if (!choice.plan && choice.engine.empty())
    return make_error("campaign",
                      "found no action, expected --engine print and a program that runs its lines "
                      "(docs/campaign.md), --plan, --status, --collect or --install");
  const auto plan = make_and_store_plan(*file, store);
  if (!plan) return tl::unexpected<Error>(plan.error());
  return choice.plan ? print_plan(*plan, store) : print_commands(*file, store);
}

/// The engines of versions up to 0.3 name their replacement.
std::string check_engine(const std::string& engine) {
  if (engine == "print") return {};
  const bool removed = engine == "local" || engine == "slurm";
  return fmt::format("found \"{}\", expected print{}", engine,
                     removed ? "; GNU parallel or a job array of Slurm runs its lines (docs/campaign.md)" : "");
}

}  // namespace

void add_campaign_command(CLI::App& app, int& code) {
  CLI::App* command =
      app.add_subcommand("campaign", "train and evaluate models of hundreds of gyros, with GNU parallel or Slurm");
  const auto choice = std::make_shared<CampaignChoice>();
  command->add_option("file", choice->file, "campaign file (JSON): recordings, models, limits, output")->required();
  CLI::Option* plan = command->add_flag("--plan", choice->plan, "print the tasks");
  CLI::Option* status =
      command->add_flag("--status", choice->status, "print the numbers of finished and failed tasks, and the reasons");
  CLI::Option* task = command->add_option("--task", choice->task, "run this task, as the printed commands do");
  CLI::Option* collected = command->add_flag(
      "--collect", choice->collect, "write the campaign's report (HTML, CSV, JSON) and the folder of accepted models");
  CLI::Option* installed =
      command->add_option("--install", choice->install, "install the accepted models in this folder, atomically");
  CLI::Option* engine =
      command
          ->add_option("--engine", choice->engine,
                       "print: one shell command per task without a result, for GNU parallel or Slurm")
          ->check(CLI::Validator(check_engine, "print", "engine"));
  plan->excludes(status)->excludes(collected)->excludes(installed)->excludes(task)->excludes(engine);
  status->excludes(collected)->excludes(installed)->excludes(task)->excludes(engine);
  collected->excludes(installed)->excludes(task)->excludes(engine);
  installed->excludes(task)->excludes(engine);
  tools::add_examples(*command,
                      {"prismcal campaign lot.json --plan", "prismcal campaign lot.json --engine print >tasks.txt",
                       "prismcal campaign lot.json --collect", "prismcal campaign lot.json --install /srv/models"});
  command->callback([choice, &code] {
    const auto done = run_campaign(*choice);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
