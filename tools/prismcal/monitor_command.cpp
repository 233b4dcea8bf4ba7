// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "compensation/earth_rate.hpp"
#include "compensation/model_text.hpp"
#include "config/monitor_file.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/model_monitor.hpp"
#include "tools/prismcal/option_table.hpp"
#include "tools/prismcal/recording_options.hpp"

namespace prism::commands {
namespace {

constexpr int kHolds = 0, kDrifted = 3, kTooLittle = 4;

struct MonitorChoice {
  std::string model, log, training, out, instance;
  CommonOptions common;
};

int code_of(const std::string& verdict) {
  return verdict == "holds" ? kHolds : verdict == "drifted" ? kDrifted : kTooLittle;
}

/// The settings of a model without them, from its residuals in a recording.
Result<compensation::MonitorSettings> settings_from(const compensation::ModelPtr& model, const std::string& path,
                                                    const MonitorChoice& choice,
                                                    const analysis::CorrectionSettings& correction) {
  const compensation::ModelInfo& info = model->info();
  auto loaded = load_blocks(path, info.features, &info, choice.common);
  if (!loaded) return tl::unexpected<Error>(loaded.error());
  const auto found = analysis::evaluate_model(model, loaded->table, correction, evaluation::Divisor::kN);
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

Result<analysis::MonitorResult> monitor_log(const compensation::ModelPtr& model, const std::string& log,
                                            const MonitorChoice& choice) {
  const compensation::ModelInfo& info = model->info();
  const auto correction = correction_settings(choice.common);
  if (!correction) return tl::unexpected<Error>(correction.error());
  auto settings = info.monitor;
  if (!choice.training.empty()) {
    const auto found = settings_from(model, choice.training, choice, *correction);
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
  auto loaded = load_blocks(log, info.features, &info, choice.common);
  if (!loaded) return tl::unexpected<Error>(loaded.error());
  const auto means = analysis::means_at_rest(model, loaded->table, *correction);
  if (!means) return tl::unexpected<Error>(means.error());
  return analysis::monitor(info, *settings, *means,
                           compensation::mount_sd_deg_per_h(loaded->table.earth_rate_deg_per_h));
}

/// The verdicts on all axes of a prismd, in its file. A model or log that cannot be used is a verdict, too.
Result<int> monitor_instance(MonitorChoice choice) {
  const auto config = config::load_config(choice.instance);
  if (!config) return tl::unexpected<Error>(config.error());
  const std::string path = config::monitor_file(*config);
  if (path.empty()) return make_error(choice.instance, "configures no log; expected one");
  config::ModelVerdicts verdicts;
  for (const config::AxisConfig& axis : config->axes) {
    if (axis.model.empty() || !config->log) continue;
    choice.model = axis.model;
    choice.common.source.axis = config->by_axes ? axis.name : "";
    choice.common.source.config = choice.instance;
    config::ModelVerdict& verdict = verdicts[config->by_axes ? axis.name : config::kOnlyAxis];
    verdict.at_s = std::time(nullptr);
    const auto model = load_model(axis.model);
    if (model) verdict.model = (*model)->info().id;
    const auto found =
        model ? monitor_log(*model, config->log->directory, choice) : tl::unexpected<Error>(model.error());
    verdict.verdict = found ? found->verdict : "failed";
    verdict.text = found ? found->text : found.error().text();
    fmt::print("{}{}\n", config->by_axes ? axis.name + ": " : "", printable(verdict.text));
  }
  if (auto done = config::write_verdicts(path, verdicts); !done) return tl::unexpected<Error>(done.error());
  return 0;
}

Result<int> run(const MonitorChoice& choice) {
  if (!choice.instance.empty()) return monitor_instance(choice);
  const auto model = load_model(choice.model);
  if (!model) return tl::unexpected<Error>(model.error());
  const auto found = monitor_log(*model, choice.log, choice);
  if (!found) return tl::unexpected<Error>(found.error());
  if (choice.common.json)
    fmt::print("{}", found->json_text());
  else
    fmt::print("{}", printable_lines(found->plain_text()));
  return code_of(found->verdict);
}

}  // namespace

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

}  // namespace prism::commands
