// SPDX-License-Identifier: MIT
// The result of a training as JSON and as readable lines.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "compensation/composite_model.hpp"
#include "compensation/training/methods.hpp"
#include "tools/prismcal/commands/method_options.hpp"

namespace prism::commands {
namespace {

using nlohmann::ordered_json;

ordered_json prior_json(const training::TrainedModel& trained) {
  const auto& prior = *static_cast<const compensation::CompositeModel&>(*trained.model).parameters().prior;
  ordered_json ids = ordered_json::array();
  for (const compensation::ModelPtr& model : prior.models) ids.push_back(model->info().id);
  return {{"scale", prior.scale}, {"explained", *trained.from_siblings}, {"models", std::move(ids)}};
}

ordered_json between_run_json(const std::optional<compensation::BetweenRunError>& error) {
  if (!error) return nullptr;
  return {{"nuisance_deg_per_h", error->nuisance_deg_per_h},
          {"offset_deg_per_h", error->offset_deg_per_h},
          {"noise_deg_per_h", error->noise_deg_per_h},
          {"factor", error->factor},
          {"blocks", error->blocks},
          {"samples", error->samples}};
}

std::string between_run_text(const training::TrainedModel& trained) {
  const std::optional<compensation::BetweenRunError>& error = trained.model->info().spread;
  using training::detail_line, training::plain_number;
  if (!error) return detail_line("another run", "not estimated: the recording is too short");
  const std::string source = error->blocks > 0
                                 ? fmt::format("{} held-out parts, {} samples", error->blocks, error->samples)
                                 : std::string("its likelihood");
  const auto number = [&](double value) { return plain_number(error->factor * value, 2); };
  // One record does not show how runs differ.
  const char* const prior = error->offset_deg_per_h > 0 ? " (a prior: one recording does not show it)" : "";
  return detail_line(
      "another run",
      fmt::format("1 sigma of the errors to expect: unexplained drift {}, constant offset {}{}, noise of a "
                  "mean {} {} (from {}; factor {:.2f})",
                  number(error->nuisance_deg_per_h), number(error->offset_deg_per_h), prior,
                  number(error->noise_deg_per_h), training::target_unit(trained), source, error->factor));
}

}  // namespace

ordered_json summary_json(const training::TrainedModel& trained, const training::TrainingSettings& settings,
                          const std::vector<std::string>& names) {
  ordered_json json = {
      {"method", settings.method->name}, {"inputs", names}, {"samples", trained.samples.fitted.size()}};
  if (trained.tuning) {
    json["tune"] = training::tuning_text(settings.tuning);
    json["folds"] =
        settings.tuning == training::Tuning::kGiven ? training::fold_count(*settings.given_folds) : settings.folds;
    json["seed"] = settings.seed;
  }
  json.update(settings.method->describe(trained, settings, names).json);
  json["spread"] = between_run_json(trained.model->info().spread);
  if (trained.from_siblings) json["prior"] = prior_json(trained);
  json["warnings"] = trained.notes;
  json["id"] = trained.model->info().id;
  return json;
}

ordered_json provenance_json(ordered_json summary) {
  summary.erase("id");
  if (summary.contains("tuning")) summary["tuning"].erase("surface");
  return summary;
}

std::string summary_text(const training::TrainedModel& trained, const training::TrainingSettings& settings,
                         const std::vector<std::string>& names) {
  using training::detail_line;
  std::string text = detail_line("model", fmt::format("{} on {}: {} samples", settings.method->name,
                                                      fmt::join(names, ", "), trained.samples.fitted.size()));
  text += settings.method->describe(trained, settings, names).text;
  text += between_run_text(trained);
  if (trained.from_siblings) {
    const auto& prior = *static_cast<const compensation::CompositeModel&>(*trained.model).parameters().prior;
    text += detail_line("prior", fmt::format("{} models of gyros of the same type, times {:.3g}: explain {:.0f} % of "
                                             "the variance of this recording",
                                             prior.models.size(), prior.scale, 100 * *trained.from_siblings));
  }
  for (const std::string& note : trained.notes) text += detail_line("note", note);
  return text;
}

}  // namespace prism::commands
