// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/campaign_work.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "base/file.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/analysis/limits.hpp"
#include "tools/prismcal/analysis/recording_report.hpp"
#include "tools/prismcal/campaign/cpu_level.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"

namespace prism::commands {
namespace {

using campaign::Role;

constexpr double kCurveBin_degc = 5;

Json number_json(std::optional<double> value) { return value && std::isfinite(*value) ? Json(*value) : Json(); }

template <class Add>
Result<void> parse_words(std::vector<std::string> words, const Add& add) {
  CLI::App app("options");
  app.set_help_flag();
  add(app);
  std::reverse(words.begin(), words.end());  // as CLI11 takes them
  try {
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return make_error("options", error.what());
  }
  return {};
}

Result<void> check_models(const campaign::CampaignFile& file) {
  for (const campaign::ModelChoice& model : file.models) {
    const std::string where = fmt::format("{}:/models/{}", file.path, model.name);
    const auto choice = train_choice(model.words);
    if (!choice) return make_error(where, choice.error().what);
    auto settings = settings_of(choice->method);
    if (!settings) return make_error(where, settings.error().text());
    const auto names = recordings::csv_fields(choice->inputs, ',');
    const auto terms = set_terms(choice->method, names, training::second_order_terms(names.size()), {}, *settings);
    if (!terms) return make_error(where, terms.error().text());
    if (!choice->prior.empty() || !choice->recordings.source.config.empty())
      return make_error(
          where, "found prior or config, expected neither: the files that they name are not among a task's inputs");
    if (!choice->serial.empty())
      return make_error(where, "found serial, expected none: each model is bound to what its recordings name");
  }
  const auto judging = evaluate_choice(file.judging);
  if (!judging) return make_error(file.path + ":/judging", judging.error().what);
  if (!judging->common.fallback.empty() || !judging->common.source.config.empty())
    return make_error(
        file.path + ":/judging",
        "found fallback or config, expected neither: the files that they name are not among a task's inputs");
  const auto correction = correction_settings(judging->common);
  if (!correction) return make_error(file.path + ":/judging", correction.error().text());
  return {};
}

/// Mean bias by temperature, about its own mean: what gyros of one lot are compared by.
Json curve_json(const std::vector<recordings::BlockTable>& tables) {
  std::map<int, std::pair<double, int>> bins;
  double sum = 0;
  int blocks = 0;
  for (const recordings::BlockTable& table : tables) {
    const auto temperature = table.column(compensation::kInputTemperature);
    for (std::size_t i = 0; i < table.size(); ++i) {
      if (!std::isfinite(temperature[i]) || !std::isfinite(table.bias_deg_per_h[i])) continue;
      auto& [bias, count] = bins[static_cast<int>(std::floor(temperature[i] / kCurveBin_degc))];
      bias += table.bias_deg_per_h[i];
      sum += table.bias_deg_per_h[i];
      ++count;
      ++blocks;
    }
  }
  Json curve = Json::array();
  for (const auto& [bin, mean] : bins)
    curve.push_back({kCurveBin_degc * (bin + 0.5), mean.first / mean.second - sum / blocks});
  return {{"mean_deg_per_h", blocks > 0 ? number_json(sum / blocks) : Json()}, {"curve_degc_deg_per_h", curve}};
}

/// A file of the recording that trained, too; empty: none. By the files themselves: seconds of a coarse rate are equal
/// by chance.
std::string shared_file(const RecordingEvaluation& judged, const campaign::Task& task) {
  for (const campaign::TaskInput& input : task.inputs) {
    for (const campaign::InputFile& file : input.files) {
      const auto same = [&](const recordings::SourceFile& source) { return source.sha256 == file.sha256; };
      const auto& files = judged.loaded.recording.files;
      if (input.role == Role::kTrain && std::any_of(files.begin(), files.end(), same)) return file.path;
    }
  }
  return {};
}

Json judged_json(const RecordingEvaluation& judged, const campaign::Task& task, const std::string& role) {
  const analysis::EvaluatedRecording recording{"r", &judged.loaded.table, &judged.evaluation, nullptr, nullptr};
  Json json = {{"role", role},
               {"recording", judged.loaded.table.name},
               {"blocks", judged.loaded.table.size()},
               {"before_deg_per_h", number_json(judged.evaluation.stability.before.sd)},
               {"trained_on", shared_file(judged, task)},
               {"measured", Json::object()}};
  for (const analysis::Measured& m : analysis::measure_all(recording))
    json["measured"][m.quantity] = number_json(m.value);
  return json;
}

/// The head of every result: who, by what, and how it ended.
Json begin_result(const campaign::Task& task, const std::string& outcome) {
  return {{"outcome", outcome},       {"task", task.id},         {"serial", task.serial}, {"axis", task.axis},
          {"model", task.model.name}, {"version", task.version}, {"level", task.level}};
}

Json refused_result(const campaign::Task& task, const Error& error) {
  Json json = begin_result(task, "refused");
  json["why"] = error.text();
  return json;
}

Result<Json> run_task(const campaign::Task& task, const std::string& folder) {
  auto choice = train_choice(task.model.words);
  if (!choice) return tl::unexpected<Error>(choice.error());
  choice->files = task.paths(Role::kTrain);
  choice->method.quiet = true;
  choice->method.threads = 1;  // an engine runs as many tasks as there are cores
  if (choice->name.empty()) choice->name = task.model.name;
  const auto trained = train_on_recordings(*choice);
  if (!trained) return refused_result(task, trained.error());
  if (trained->set.serial != task.serial)
    return make_error(task.id,
                      fmt::format("trained on gyro \"{}\", expected \"{}\"", trained->set.serial, task.serial));
  auto judging = evaluate_choice(task.judging);
  if (!judging) return tl::unexpected<Error>(judging.error());
  judging->model = folder + "/model.json";
  if (auto done = write_text_file(judging->model, trained->model_text()); !done)
    return tl::unexpected<Error>(done.error());
  std::vector<std::string> roles;
  for (const Role role : {Role::kRepeat, Role::kOther}) {
    for (std::string& path : task.paths(role)) {
      judging->recordings.push_back(std::move(path));
      roles.emplace_back(campaign::role_name(role));
    }
  }
  const auto judgement = evaluate_recordings(*judging);
  if (!judgement) return refused_result(task, judgement.error());
  judging->common.json = false;
  judging->common.quiet = true;
  judging->common.out = task.report ? folder + "/report" : "";
  if (auto done = write_report(judgement->report, judging->common); !done) return tl::unexpected<Error>(done.error());
  Json json = begin_result(task, "trained");
  json["id"] = trained->trained.model->info().id;
  for (const Json& facts : trained->set.facts) json["data_quality"].push_back(facts["data_quality"]);
  json["training"] = curve_json(trained->set.tables);
  for (std::size_t i = 0; i < roles.size(); ++i)
    json["judged"].push_back(judged_json(judgement->cases[i], task, roles[i]));
  json["simulated"] = judgement->report.simulated;
  return json;
}

}  // namespace

Result<TrainChoice> train_choice(const std::vector<std::string>& words) {
  TrainChoice choice;
  const auto done = parse_words(words, [&](CLI::App& app) { add_train_options(app, choice); });
  if (!done) return tl::unexpected<Error>(done.error());
  return choice;
}

Result<EvaluateChoice> evaluate_choice(const std::vector<std::string>& words) {
  EvaluateChoice choice;
  const auto done = parse_words(words, [&](CLI::App& app) { add_common_options(app, choice.common); });
  if (!done) return tl::unexpected<Error>(done.error());
  return choice;
}

campaign::Work campaign_work(const std::string& calibration) {
  const auto costs = std::make_shared<CostModel>(calibration);
  return {kVersion, campaign::loaded_level(), check_models,
          [costs](const campaign::Task& task, std::uint64_t training_s, std::uint64_t judged_s) {
            return costs->cost(task, training_s, judged_s);
          },
          run_task};
}

}  // namespace prism::commands
