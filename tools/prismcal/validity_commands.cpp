// SPDX-License-Identifier: MIT
// Commands that keep a model valid: monitor and train --from, which compare a log at rest with the Earth rate; history.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/text_number.hpp"
#include "compensation/at_rest.hpp"
#include "compensation/composite_model.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/model_text.hpp"
#include "compensation/polynomial_model.hpp"
#include "config/version.hpp"
#include "daemon/pipeline/statements.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/log_folder.hpp"
#include "tools/prismcal/model_monitor.hpp"
#include "tools/prismcal/training_run.hpp"

namespace prism::commands {
namespace {

using compensation::Model, compensation::ModelPtr;
using nlohmann::ordered_json;

constexpr int kHolds = 0, kDrifted = 3, kTooLittle = 4;
constexpr double kLeastRest_h = 0.5;

/// Of monitor and history.
struct MonitorChoice {
  std::string model, log, training, out, instance;
  CommonOptions common;
};

/// The windows at rest of a log, for a model.
struct RestLog {
  Loaded log;
  std::vector<analysis::RestMean> means;
  double mount_sd_deg_per_h;
};

/// `unmatched`: see load_blocks().
Result<RestLog> read_rest(const ModelPtr& model, const std::string& path, const CommonOptions& options,
                          recordings::UnmatchedRanges* unmatched = nullptr) {
  const auto correction = correction_settings(options);
  if (!correction) return tl::unexpected<Error>(correction.error());
  auto log = load_blocks(path, model->info(), options, unmatched);
  if (!log) return tl::unexpected<Error>(log.error());
  auto means = analysis::means_at_rest(model, log->table, *correction);
  if (!means) return tl::unexpected<Error>(means.error());
  const double earth_rate_deg_per_h = log->table.earth_rate_deg_per_h;
  return RestLog{std::move(*log), std::move(*means),
                 compensation::mount_sd_deg_per_h(earth_rate_deg_per_h, correction->direction_rad)};
}

/// The settings of a model without them, from its residuals in a recording.
Result<compensation::MonitorSettings> settings_from(const ModelPtr& model, const std::string& path,
                                                    const CommonOptions& options,
                                                    recordings::UnmatchedRanges& unmatched) {
  const compensation::ModelInfo& info = model->info();
  const auto correction = correction_settings(options);
  if (!correction) return tl::unexpected<Error>(correction.error());
  auto loaded = load_blocks(path, info, options, &unmatched);
  if (!loaded) return tl::unexpected<Error>(loaded.error());
  const auto found = analysis::evaluate_model(model, loaded->table, *correction, evaluation::Divisor::kN);
  if (!found) return tl::unexpected<Error>(found.error());
  evaluation::Residuals residuals{
      found->where_corrected(found->corrected_deg_per_h), {}, 1, double(info.features.length_s)};
  residuals.recordings.assign(residuals.deg_per_h.size(), 0);
  const compensation::BetweenRunError spread = info.spread.value_or(compensation::BetweenRunError{});
  // The model knows this recording: its own statement of the error is the least.
  const double least_sd = std::hypot(spread.noise_deg_per_h, spread.factor * spread.nuisance_deg_per_h);
  auto settings = evaluation::monitor_settings(std::move(residuals), spread.factor * spread.offset_deg_per_h, least_sd);
  if (!settings) return make_error(path, "too short to set the monitor; expected 100 windows of the training or more");
  return *settings;
}

Result<analysis::MonitorResult> monitor_log(const ModelPtr& model, const MonitorChoice& choice) {
  const compensation::ModelInfo& info = model->info();
  auto settings = info.monitor;
  recordings::UnmatchedRanges unmatched(choice.common.source.leave_out);
  if (!choice.training.empty()) {
    const auto found = settings_from(model, choice.training, choice.common, unmatched);
    if (!found) return tl::unexpected<Error>(found.error());
    settings = *found;
  }
  if (!settings)
    return make_error(choice.model,
                      "has no key monitor; expected it, or --training with the recording of the training");
  if (!choice.out.empty()) {
    const std::string text = compensation::format_model(*model, info.provenance_json, info.noise, settings);
    if (auto done = write_text_file(choice.out, text); !done) return tl::unexpected<Error>(done.error());
  }
  auto rest = read_rest(model, choice.log, choice.common, &unmatched);
  if (!rest) return tl::unexpected<Error>(rest.error());
  if (auto good = unmatched.finish(); !good) return tl::unexpected<Error>(good.error());
  std::erase_if(rest->means, [&](const analysis::RestMean& mean) { return mean.second < settings->since_s; });
  return analysis::monitor(info, *settings, rest->means, rest->mount_sd_deg_per_h);
}

/// The verdicts on all axes of a prismd, in its file. A model or log that cannot be used is a verdict, too.
Result<int> monitor_instance(MonitorChoice choice) {
  const auto config = config::load_config(choice.instance);
  if (!config) return tl::unexpected<Error>(config.error());
  const std::string path = pipeline::monitor_file(*config);
  if (path.empty()) return make_error(choice.instance, "configures no log; expected one");
  pipeline::ModelVerdicts verdicts;
  for (const config::AxisConfig& axis : config->axes) {
    if (axis.model.empty() || !config->log) continue;
    choice.model = axis.model;
    choice.log = config->log->directory;
    choice.common.source.axis = config->by_axes ? axis.name : "";
    choice.common.source.config = choice.instance;
    pipeline::ModelVerdict& verdict = verdicts[config->by_axes ? axis.name : pipeline::kOnlyAxis];
    verdict.at_s = std::time(nullptr);
    const auto model = load_model(axis.model);
    if (model) verdict.model = (*model)->info().id;
    const auto found = model ? monitor_log(*model, choice) : tl::unexpected<Error>(model.error());
    verdict.verdict = found ? found->verdict : "failed";
    verdict.text = found ? found->text : found.error().text();
    fmt::print("{}{}\n", config->by_axes ? axis.name + ": " : "", printable(verdict.text));
  }
  if (auto done = pipeline::write_verdicts(path, verdicts); !done) return tl::unexpected<Error>(done.error());
  return 0;
}

Result<int> run(const MonitorChoice& choice) {
  if (!choice.instance.empty()) return monitor_instance(choice);
  const auto model = load_model(choice.model);
  if (!model) return tl::unexpected<Error>(model.error());
  const auto found = monitor_log(*model, choice);
  if (!found) return tl::unexpected<Error>(found.error());
  fmt::print("{}", choice.common.json ? found->json_text() : printable_lines(found->plain_text()));
  return found->verdict == "holds" ? kHolds : found->verdict == "drifted" ? kDrifted : kTooLittle;
}

/// The model with a constant added to its bias.
Result<ModelPtr> with_constant(const Model& model, compensation::ModelInfo info, double added_deg_per_h) {
  if (const auto* polynomial = dynamic_cast<const compensation::PolynomialModel*>(&model)) {
    std::vector<compensation::Term> terms = polynomial->terms();
    const std::vector<int> none(info.inputs.size(), 0);
    auto constant = std::ranges::find_if(terms, [&](const auto& term) { return term.powers == none; });
    if (constant == terms.end()) constant = terms.insert(terms.begin(), compensation::Term{none, 0});
    constant->coefficient += added_deg_per_h;
    return std::make_shared<compensation::PolynomialModel>(std::move(info), terms, polynomial->sd_deg_per_h());
  }
  if (const auto* composite = dynamic_cast<const compensation::CompositeModel*>(&model)) {
    compensation::CompositeParameters parameters = composite->parameters();
    parameters.normalisation.target_shift += added_deg_per_h;
    return compensation::CompositeModel::make(std::move(info), std::move(parameters));
  }
  compensation::LssvmParameters parameters = dynamic_cast<const compensation::LssvmModel&>(model).parameters();
  parameters.normalisation.target_shift += added_deg_per_h;
  return compensation::LssvmModel::make(std::move(info), std::move(parameters));
}

/// Rows with one model, in the order of the log.
struct Period {
  std::string model;  ///< id and name, or "none"
  std::int64_t first_s, last_s = 0;
  std::size_t rows = 0;
};

Result<int> history(const MonitorChoice& choice) {
  auto folder = recordings::LogFolder::open(choice.log, choice.common.source.axis);
  if (!folder) return tl::unexpected<Error>(folder.error());
  std::vector<Period> periods;
  for (recordings::LogSegment& segment : folder->segments) {
    std::int64_t last_s = 0;
    const auto at = [&](const recordings::LogRow& row) -> Result<void> {
      last_s = row.second_mean.second;
      return {};
    };
    if (auto done = recordings::read_log_segment(segment, at); !done) return tl::unexpected<Error>(done.error());
    if (segment.rows == 0) continue;
    const std::string model = segment.value("model");
    if (periods.empty() || periods.back().model != model) periods.push_back({model, *segment.first_second});
    periods.back().last_s = last_s;
    periods.back().rows += segment.rows;
  }
  for (const Period& period : periods) {
    const std::size_t space = std::min(period.model.find(' '), period.model.size());  // after the id
    fmt::print("{} to {}  {:>9} rows  {}{}\n", utc_text(period.first_s), utc_text(period.last_s), period.rows,
               printable(period.model.substr(0, std::min<std::size_t>(space, 12))),
               printable(period.model.substr(space)));
  }
  return 0;
}

}  // namespace

Result<ordered_json> train_from(const TrainChoice& choice) {
  if (choice.files.size() != 1)
    return make_error("--from", fmt::format("found {} recordings, expected one", choice.files.size()));
  const auto loaded = load_model(choice.from);
  if (!loaded) return tl::unexpected<Error>(loaded.error());
  const Model& model = **loaded;
  const compensation::ModelInfo& first = model.info();
  CommonOptions options;
  options.source = choice.recordings.source;
  options.site = choice.recordings.site;
  options.quiet = choice.method.quiet;
  const auto rest = read_rest(*loaded, choice.files.front(), options);
  if (!rest) return tl::unexpected<Error>(rest.error());
  const auto& [recording, table] = rest->log;
  const double length_s = first.features.length_s, seen_h = static_cast<double>(rest->means.size()) * length_s / 3600;
  if (seen_h < kLeastRest_h)
    return make_error(table.name, fmt::format("found {:.2g} h at rest with a good correction, expected {:g} h", seen_h,
                                              kLeastRest_h));
  // Model and mount have the same error in all means.
  const double white_sd = noise_of(first)->n_deg_per_sqrt_h * std::sqrt(3600 / length_s);
  const auto found = analysis::mean_difference(rest->means, {.sd_deg_per_h = white_sd}, length_s);
  double variance = rest->mount_sd_deg_per_h * rest->mount_sd_deg_per_h + found.within_sd * found.within_sd;
  for (const analysis::RestMean& mean : rest->means)
    variance += mean.sd_deg_per_h * mean.sd_deg_per_h / static_cast<double>(rest->means.size());
  const double moved = found.deg_per_h, half = 2 * std::sqrt(variance);
  if (!std::isfinite(half))
    return make_error(first.name, "does not state how runs differ; expected a model of 0.2 or later");
  if (std::abs(moved) <= half && !choice.force)
    return make_error(table.name, fmt::format("the bias moved by {:+.4f} ± {:.4f} deg/h (2 sd), which may be none: the "
                                              "model stays; --force writes it anyway",
                                              moved, half));
  const ordered_json constant = {
      {"from", first.id},
      {"moved_deg_per_h", moved},
      {"interval_deg_per_h", {moved - half, moved + half}},
      {"at_rest_s", first.features.length_s * static_cast<std::int64_t>(rest->means.size())}};
  ordered_json provenance = ordered_json::parse(first.provenance_json);
  provenance["tool"] = std::string("prismcal ") + kVersion;
  provenance["made"] = utc_text(std::time(nullptr));
  provenance["recordings"].push_back(recordings::facts_of(recording, table, 0));
  provenance["constant"] = constant;
  compensation::ModelInfo info = first;
  info.provenance_json = json_text(provenance);
  if (info.monitor && table.is_date) info.monitor->since_s = table.first_s;
  if (!choice.name.empty()) info.name = choice.name;
  const auto made = with_constant(model, std::move(info), moved);
  if (!made) return tl::unexpected<Error>(made.error());
  if (auto done = write_text_file(choice.out, compensation::format_model(**made)); !done)
    return tl::unexpected<Error>(done.error());
  if (!choice.method.json)
    fmt::print(
        "the bias moved by {:+.4f} ± {:.4f} deg/h (2 sd) in {:.1f} h at rest; {} has it in its constant, and the shape "
        "of model {:.12}; next: check it on another log, then prismctl reload\n",
        moved, half, seen_h, choice.out, first.id);
  ordered_json summary = constant;
  summary["id"] = (*made)->info().id;
  return summary;
}

void add_monitor_command(CLI::App& app, int& code) {
  CLI::App* command =
      app.add_subcommand("monitor", "does a model still hold in a log, at rest? exit code 3: it does not");
  const auto choice = std::make_shared<MonitorChoice>();
  CLI::Option* model = command->add_option("model", choice->model, "model file");
  CLI::Option* log =
      command->add_option("log", choice->log, "prismd's log (file or folder), capture, or CSV with --map");
  add_options(*command,
              {{"--training", &choice->training, "for a model without the key monitor: the recording of its training"},
               {"--out", &choice->out, "write the model with that key; its id does not change"},
               {"--instance", &choice->instance,
                "configuration of a prismd instead of model and log: all its axes; the verdicts go to monitor.json"},
               {"--any-gyro", &choice->common.any_gyro, "accept a log of another gyro than the model's"},
               {"--json", &choice->common.json, "print JSON"}});
  add_source_options(*command, choice->common.source);
  add_site_options(*command, choice->common.site);
  tools::add_examples(*command, {"prismcal monitor model.json /var/log/prismd/gyro1",
                                 "prismcal monitor --instance /etc/prism/gyro1.json"});
  command->callback([=, &code] {
    if (choice->instance.empty() && (model->count() == 0 || log->count() == 0))
      throw CLI::RequiredError("model and log, or --instance");
    code = exit_code(run(*choice));
  });
}

void add_history_command(CLI::App& app, int& code) {
  const auto [command, choice] =
      new_command<MonitorChoice>(app, code, "history", "which model corrected the rows of a log, and when", history);
  command.add_option("log", choice.log, "prismd's log: a file or a folder")->required();
  command.add_option("--axis", choice.common.source.axis, "axis of a log of several");
  tools::add_examples(command, {"prismcal history /var/log/prismd/gyro1"});
}

}  // namespace prism::commands
