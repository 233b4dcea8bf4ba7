// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/campaign_work.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "compensation/kernels/kernels.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/analysis/limits.hpp"
#include "tools/prismcal/analysis/recording_report.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"

namespace prism::commands {
namespace {

using campaign::Role;

constexpr double kCurveBin_degc = 5;

Json number_json(std::optional<double> value) { return value && std::isfinite(*value) ? Json(*value) : Json(); }

template <class Add>
Result<void> parse_options(std::vector<std::string> words, const Add& add) {
  CLI::App app("options");
  app.set_help_flag();
  add(app);
  std::reverse(words.begin(), words.end());  // the order that CLI11 expects
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
      return make_error(where, "found prior or config, expected neither: their files are not inputs of a task");
    if (!choice->serial.empty())
      return make_error(where, "found serial, expected none: a model is bound to the serial number in its recordings");
  }
  const auto judging = evaluate_choice(file.judging);
  if (!judging) return make_error(file.path + ":/judging", judging.error().what);
  if (!judging->common.fallback.empty() || !judging->common.source.config.empty())
    return make_error(file.path + ":/judging",
                      "found fallback or config, expected neither: their files are not inputs of a task");
  const auto correction = correction_settings(judging->common);
  if (!correction) return make_error(file.path + ":/judging", correction.error().text());
  return {};
}

/// Mean bias in bins of temperature, minus the overall mean, for the comparison of gyros in a lot.
Json curve_json(const std::vector<TrainingRun::Curve>& curves) {
  std::map<int, std::pair<double, int>> bins;
  double sum = 0;
  int blocks = 0;
  for (const TrainingRun::Curve& curve : curves) {
    for (std::size_t i = 0; i < curve.bias_deg_per_h.size(); ++i) {
      if (!std::isfinite(curve.temperature_degc[i]) || !std::isfinite(curve.bias_deg_per_h[i])) continue;
      auto& [bias, count] = bins[static_cast<int>(std::floor(curve.temperature_degc[i] / kCurveBin_degc))];
      bias += curve.bias_deg_per_h[i];
      sum += curve.bias_deg_per_h[i];
      ++count;
      ++blocks;
    }
  }
  Json curve = Json::array();
  for (const auto& [bin, mean] : bins)
    curve.push_back({kCurveBin_degc * (bin + 0.5), mean.first / mean.second - sum / blocks});
  return {{"mean_deg_per_h", blocks > 0 ? number_json(sum / blocks) : Json()}, {"curve_degc_deg_per_h", curve}};
}

/// Returns a file of the recording that was also used for training; empty: none. Compares SHA-256, since equal seconds
/// of a coarse rate may be chance.
std::string shared_file(const RecordingEvaluation& evaluated, const campaign::Task& task) {
  for (const campaign::TaskInput& input : task.inputs) {
    for (const campaign::InputFile& file : input.files) {
      const auto same = [&](const recordings::SourceFile& source) { return source.sha256 == file.sha256; };
      const auto& files = evaluated.loaded.recording.files;
      if (input.role == Role::kTrain && std::any_of(files.begin(), files.end(), same)) return file.path;
    }
  }
  return {};
}

Json evaluation_json(const RecordingEvaluation& evaluated, const campaign::Task& task, const std::string& role) {
  const analysis::EvaluatedRecording recording{"r", &evaluated.loaded.table, &evaluated.evaluation, nullptr};
  Json json = {{"role", role},
               {"recording", evaluated.loaded.table.name},
               {"blocks", evaluated.loaded.table.size()},
               {"before_deg_per_h", number_json(evaluated.evaluation.stability.before.sd)},
               {"trained_on", shared_file(evaluated, task)},
               {"measured", Json::object()}};
  for (const analysis::Measured& m : analysis::measure_all(recording))
    json["measured"][m.quantity] = number_json(m.value);
  return json;
}

/// "x86-64-v4", "x86-64-v3" or "baseline": the processor level for which the loaded libprism-kernels was compiled.
std::string loaded_level() {
  Dl_info found{};
  if (::dladdr(reinterpret_cast<const void*>(&kernels::rbf_row), &found) == 0 || !found.dli_fname) return "baseline";
  const std::string path = found.dli_fname;
  for (const char* level : {"x86-64-v4", "x86-64-v3"}) {
    if (path.find(fmt::format("/glibc-hwcaps/{}/", level)) != std::string::npos) return level;
  }
  return "baseline";
}

/// The members that all results have. `outcome`: "trained" or "refused".
Json begin_result(const campaign::Task& task, const std::string& outcome) {
  return {{"outcome", outcome},       {"task", task.id},         {"serial", task.serial},  {"axis", task.axis},
          {"model", task.model.name}, {"version", task.version}, {"level", loaded_level()}};
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
  choice->method.threads = 1;  // one task per core
  if (choice->name.empty()) choice->name = task.model.name;
  const auto trained = train_on_recordings(*choice);
  if (!trained) return refused_result(task, trained.error());
  if (trained->set.serial != task.serial)
    return make_error(task.id,
                      fmt::format("trained on gyro \"{}\", expected \"{}\"", trained->set.serial, task.serial));
  auto evaluation = evaluate_choice(task.judging);
  if (!evaluation) return tl::unexpected<Error>(evaluation.error());
  evaluation->model = folder + "/model.json";
  if (auto done = write_text_file(evaluation->model, trained->model_text()); !done)
    return tl::unexpected<Error>(done.error());
  std::vector<std::string> roles;
  for (const Role role : {Role::kRepeat, Role::kOther}) {
    for (std::string& path : task.paths(role)) {
      evaluation->recordings.push_back(std::move(path));
      roles.emplace_back(campaign::role_name(role));
    }
  }
  evaluation->common.json = false;
  evaluation->common.quiet = true;
  const auto evaluated = evaluate_recordings(*evaluation);
  if (!evaluated) return refused_result(task, evaluated.error());
  evaluation->common.out = task.report ? folder + "/report" : "";
  if (auto done = write_report(evaluated->report, evaluation->common); !done)
    return tl::unexpected<Error>(done.error());
  Json json = begin_result(task, "trained");
  json["id"] = trained->trained.model->info().id;
  for (const Json& facts : trained->set.facts) json["data_quality"].push_back(facts["data_quality"]);
  json["training"] = curve_json(trained->curves);
  for (std::size_t i = 0; i < roles.size(); ++i)
    json["judged"].push_back(evaluation_json(evaluated->cases[i], task, roles[i]));
  json["simulated"] = evaluated->report.simulated;
  return json;
}

}  // namespace

Result<TrainChoice> train_choice(const std::vector<std::string>& words) {
  TrainChoice choice;
  const auto done = parse_options(words, [&](CLI::App& app) { add_train_options(app, choice); });
  if (!done) return tl::unexpected<Error>(done.error());
  return choice;
}

Result<EvaluateChoice> evaluate_choice(const std::vector<std::string>& words) {
  EvaluateChoice choice;
  const auto done = parse_options(words, [&](CLI::App& app) { add_common_options(app, choice.common); });
  if (!done) return tl::unexpected<Error>(done.error());
  return choice;
}

campaign::Work campaign_work() { return {kVersion, check_models, run_task}; }

}  // namespace prism::commands
