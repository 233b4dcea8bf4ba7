// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/lot.hpp"
#include "tools/prismcal/recording_report.hpp"
#include "tools/prismcal/training_run.hpp"

namespace prism::commands {
namespace {

using campaign::Lot, campaign::LotFile, campaign::Task;

// Work of a task.

/// Parses options as the command line does. Errors: "--method=lq: …".
template <class Choice>
Result<Choice> parse_options(std::vector<std::string> words, void (*add)(CLI::App&, Choice&)) {
  CLI::App app("options");
  app.set_help_flag();
  Choice choice;
  add(app, choice);
  std::ranges::reverse(words);  // the order that CLI11 expects
  try {
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return make_error("options", error.what());
  }
  return choice;
}

/// Errors: unknown options, and those that contradict each other.
Result<void> check_options(const LotFile& file) {
  for (const campaign::ModelChoice& model : file.models) {
    const std::string where = fmt::format("{}:/models/{}", file.path, model.name);
    const auto choice = parse_options(model.words, add_train_options);
    if (!choice) return make_error(where, choice.error().what);
    const auto names = tables::list_items(choice->inputs);
    const auto good = settings_of(choice->method).and_then([&](training::TrainingSettings settings) {
      return set_terms(choice->method, names, settings);
    });
    if (!good) return make_error(where, good.error().text());
  }
  if (const auto choice = parse_options(file.judging, add_common_options); !choice)
    return make_error(file.path + ":/judging", choice.error().what);
  return {};
}

Result<Json> run_work(const Task& task, const std::string& folder) {
  const auto refused = [](const Error& error) { return Json{{"outcome", "refused"}, {"why", error.text()}}; };
  auto choice = parse_options(task.words("train"), add_train_options);
  if (!choice) return tl::unexpected<Error>(choice.error());
  choice->files = task.paths(campaign::kTrain);
  choice->serial = task.serial();
  choice->method.quiet = true;
  choice->method.settings.threads = 1;  // one task per core
  if (choice->name.empty()) choice->name = task.model();
  const auto trained = train_on_recordings(*choice);
  if (!trained) return refused(trained.error());
  if (const std::string& serial = trained->set.serial; !serial.empty() && serial != task.serial())
    return make_error(task.id(), fmt::format("trained on gyro \"{}\", expected \"{}\"", serial, task.serial()));
  auto common = parse_options(task.words("judging"), add_common_options);
  if (!common) return tl::unexpected<Error>(common.error());
  common->json = false;
  common->quiet = true;
  EvaluateChoice evaluation{folder + "/model.json", "", task.paths(campaign::kRepeat), false, std::move(*common)};
  if (auto done = write_text_file(evaluation.model, trained->model_text()); !done)
    return tl::unexpected<Error>(done.error());
  const std::size_t repeats = evaluation.recordings.size();
  for (std::string& path : task.paths(campaign::kOther)) evaluation.recordings.push_back(std::move(path));
  const auto evaluated = evaluate_recordings(evaluation);
  if (!evaluated) return refused(evaluated.error());
  evaluation.common.out = task.json.at("report") ? folder + "/report" : "";
  if (auto done = write_report(evaluated->report, evaluation.common); !done) return tl::unexpected<Error>(done.error());
  Json result = {{"outcome", "trained"},
                 {"id", trained->trained.model->info().id},
                 {"simulated", evaluated->report.simulated},
                 {"data_quality", Json::array()},
                 {"training", {{"mean_deg_per_h", trained->set.data.target.mean()}}},
                 {"judged", Json::array()}};
  for (const auto& quality : trained->set.qualities)
    result["data_quality"].push_back(analysis::data_quality_words(quality));
  for (const analysis::EvaluatedRecording& one : evaluated->cases) {
    Json measured = Json::object();
    for (const analysis::Measured& m : analysis::measure_all(one))
      measured[m.quantity] = m.value ? Json(*m.value) : Json();
    measured["before_deg_per_h"] = one.evaluation.stability.before.sd;
    result["judged"].push_back({{"role", result["judged"].size() < repeats ? campaign::kRepeat : campaign::kOther},
                                {"recording", one.loaded.table.name},
                                {"trained_on", one.overlap},
                                {"measured", measured}});
  }
  return result;
}

// Actions.

struct CampaignChoice {
  std::string file, engine, task, install;
  bool plan = false, status = false, collect = false;
};

/// One shell command for each task without a result: it needs nothing but the directories and this program.
void print_commands(const Lot& lot, const LotFile& file) {
  std::error_code error;
  const std::string program = std::filesystem::read_symlink("/proc/self/exe", error).string();
  for (const Task& task : lot.tasks) {
    if (!task.done())
      fmt::print("{} campaign {} --task {}\n", shell_word(program), shell_word(file.path), shell_word(task.name()));
  }
}

/// How many tasks are done, those that were refused, or `all`, and what is left out.
void print_status(const Lot& lot, bool all) {
  fmt::print("{} of {} tasks done\n", std::ranges::count_if(lot.tasks, &Task::done), lot.tasks.size());
  for (const Task& task : lot.tasks) {
    const std::string state = task.state(), why = state == "refused" ? ": " + task.violations.front() : "";
    if (all || !why.empty()) fmt::print("{}: {}{}\n", state, printable(task.name()), printable(why));
  }
  for (const auto& [what, why] : lot.left_out) fmt::print("left out: {}: {}\n", printable(what), printable(why));
}

Result<int> collect(const LotFile& file, const Lot& lot) {
  CommonOptions options;
  options.out = file.folder + "/report";
  const auto report = campaign::lot_report(file, lot);
  if (auto done = write_report(report, options); !done) return tl::unexpected<Error>(done.error());
  fmt::print("{}\n", printable(report.subtitle));
  if (!report.warning.empty()) fmt::print(stderr, "prismcal: {}\n", printable(report.warning));
  return std::ranges::all_of(lot.tasks, &Task::done) ? 0 : 1;
}

Result<int> run_campaign(const CampaignChoice& choice) {
  const auto file = read_text_file(choice.file).and_then([&](const std::string& text) {
    return campaign::parse_lot_file(text, choice.file);
  });
  if (!file) {
    constexpr int kExitConfig = 78;  // as the other programs with a file that they cannot use
    fmt::print(stderr, "prismcal: {}\n", printable(file.error().text()));
    return kExitConfig;
  }
  for (const std::string& warning : file->warnings) fmt::print(stderr, "prismcal: warning: {}\n", warning);
  if (auto good = check_options(*file); !good) return tl::unexpected<Error>(good.error());
  if (!choice.task.empty()) {
    return campaign::make_plan(*file, choice.task)
        .and_then([&](const Lot& plan) { return campaign::run_task(*file, plan.tasks.front(), run_work); })
        .map([] { return 0; });
  }
  if (!choice.plan && choice.engine.empty() && !choice.status && !choice.collect && choice.install.empty())
    return make_error("campaign",
                      "found no action, expected --engine print and a program that runs its lines "
                      "(docs/campaign.md), --plan, --status, --collect or --install");
  const auto lot = campaign::read_lot(*file);
  if (!lot) return tl::unexpected<Error>(lot.error());
  if (!choice.engine.empty()) return print_commands(*lot, *file), 0;
  if (choice.plan || choice.status) return print_status(*lot, choice.plan), 0;
  if (choice.collect) return collect(*file, *lot);
  const auto installed = campaign::install_models(*file, *lot, choice.install);
  if (!installed) return tl::unexpected<Error>(installed.error());
  fmt::print("{} models installed in {}; {} tasks without a result\n", *installed, choice.install,
             lot->tasks.size() - std::ranges::count_if(lot->tasks, &Task::done));
  return 0;
}

/// The engines of versions up to 0.3 have a replacement.
std::string check_engine(const std::string& engine) {
  if (engine == "print") return {};
  return fmt::format(
      "found \"{}\", expected print; GNU parallel or a job array of Slurm runs its lines "
      "(docs/campaign.md)",
      engine);
}

}  // namespace

void add_campaign_command(CLI::App& app, int& code) {
  const auto [command, choice] = new_command<CampaignChoice>(
      app, code, "campaign", "train and evaluate models of hundreds of gyros, with GNU parallel or Slurm",
      run_campaign);
  add_options(command, {{"file", &choice.file, "campaign file (JSON): recordings, models, limits, output"}},
              Need::kRequired);
  const auto actions = add_options(
      command,
      {{"--plan", &choice.plan, "print the tasks"},
       {"--status", &choice.status, "print the number of finished tasks, and those that were refused"},
       {"--task", &choice.task, "run this task, as the printed commands do"},
       {"--collect", &choice.collect, "write the campaign's report (HTML, CSV, JSON)"},
       {"--install", &choice.install, "install the accepted models in this folder, atomically"},
       {"--engine", &choice.engine, "print: one shell command per task without a result, for GNU parallel or Slurm",
        CLI::Validator(check_engine, "print", "engine")}});
  for (std::size_t i = 0; i < actions.size(); ++i) {
    for (std::size_t j = i + 1; j < actions.size(); ++j) actions[i]->excludes(actions[j]);
  }
  tools::add_examples(command,
                      {"prismcal campaign lot.json --plan", "prismcal campaign lot.json --engine print >tasks.txt",
                       "prismcal campaign lot.json --collect", "prismcal campaign lot.json --install /srv/models"});
}

}  // namespace prism::commands
