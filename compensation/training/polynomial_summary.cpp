// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "compensation/polynomial_model.hpp"
#include "compensation/training/methods.hpp"
#include "compensation/training/summary.hpp"

namespace prism::training {
namespace {

std::string named(const TrainingSettings& settings, int term, const std::vector<std::string>& names) {
  return term_name(settings.terms[static_cast<std::size_t>(term)], names);
}

nlohmann::ordered_json coefficients_json(const TrainedModel& trained, const std::vector<std::string>& names) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const compensation::Term& term : static_cast<const compensation::PolynomialModel&>(*trained.model).terms())
    json[term_name(term.powers, names)] = term.coefficient;
  return json;
}

nlohmann::ordered_json p_values(const std::vector<double>& p, const TrainingSettings& settings,
                                const std::vector<std::string>& names) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (std::isfinite(p[i])) json[named(settings, static_cast<int>(i), names)] = p[i];
  }
  return json;
}

nlohmann::ordered_json path_json(const StepwiseResult& result, const TrainingSettings& settings,
                                 const std::vector<std::string>& names) {
  nlohmann::ordered_json path = nlohmann::ordered_json::array();
  for (const StepwiseStep& step : result.path) {
    nlohmann::ordered_json entry = {{"action", step.action}};
    if (step.term >= 0)
      entry.update({{"term", named(settings, step.term, names)},
                    {"p", finite_json(step.p)},
                    {"t", finite_json(step.t)},
                    {"F", finite_json(step.t * step.t)}});
    if (!step.candidate_p.empty()) entry["candidate_p"] = p_values(step.candidate_p, settings, names);
    if (!step.in_model_p.empty()) entry["in_model_p"] = p_values(step.in_model_p, settings, names);
    entry["terms"] = nlohmann::ordered_json::array();
    for (const int term : step.terms) entry["terms"].push_back(named(settings, term, names));
    path.push_back(std::move(entry));
  }
  return path;
}

std::string lines_of(const TrainedModel& trained, const TrainingSettings& settings,
                     const std::vector<std::string>& names) {
  std::string text =
      detail_line("coefficients", target_unit(trained) + " over the units of the term" +
                                      (trained.model->info().table ? "" : " (T degC, dTdt degC/s, U V)"));
  for (const compensation::Term& term : static_cast<const compensation::PolynomialModel&>(*trained.model).terms())
    text += detail_line("", fmt::format("{:<10} {: .6g}", term_name(term.powers, names), term.coefficient));
  if (trained.stepwise) {
    text += detail_line("steps", "p: probability that a term without effect improves the fit so much");
    for (const StepwiseStep& step : trained.stepwise->path) {
      if (step.term >= 0)
        text += detail_line(
            "", fmt::format("{:<7} {:<10} p {:.2g}", step.action, named(settings, step.term, names), step.p));
    }
  }
  text += detail_line("residual", plain_number(trained.linear->sd(), 3) + " " + target_unit(trained) +
                                      ": 1 sigma that the model leaves in its own recording");
  return text +
         detail_line("condition", fmt::format("{:.3g}: above 1e8 the terms are almost the same", trained.condition));
}

}  // namespace

MethodSummary describe_polynomial(const TrainedModel& trained, const TrainingSettings& settings,
                                  const std::vector<std::string>& names) {
  nlohmann::ordered_json json;
  json["coefficients"] = coefficients_json(trained, names);
  json["sse"] = trained.linear->sse;
  json["df"] = trained.linear->df;
  json["sd"] = trained.linear->sd();
  json["condition"] = finite_json(trained.condition);
  if (trained.stepwise) json["path"] = path_json(*trained.stepwise, settings, names);
  return {std::move(json), lines_of(trained, settings, names)};
}

}  // namespace prism::training
