// SPDX-License-Identifier: MIT
// The result of a training as JSON and as readable lines.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "compensation/composite_model.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/polynomial_model.hpp"
#include "compensation/training/trainer.hpp"
#include "tools/prismcal/commands/method_options.hpp"

namespace prism::commands {
namespace {

using nlohmann::ordered_json;
using training::TrainedModel, training::TrainingSettings;
using Names = std::vector<std::string>;

/// The number, or null if it is not finite.
ordered_json finite_json(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr); }

/// "  skill          0.79: …": a value with its unit and meaning, or the next value of the same name (empty).
std::string detail_line(const std::string& name, const std::string& text) {
  return fmt::format("  {:<14} {}\n", name, text);
}

std::string target_unit(const TrainedModel& trained) {
  return trained.model->info().table ? "units of the target" : "deg/h";
}

/// `value` with `digits` significant digits, and without an exponent from 1e-7 to 1e9: 170, 0.0004.
std::string plain_number(double value, int digits) {
  if (!std::isfinite(value)) return fmt::format("{}", value);
  if (value == 0) return "0";
  if (std::abs(value) < 1e-7 || std::abs(value) > 1e9) return fmt::format("{:.{}g}", value, digits);
  const int power = static_cast<int>(std::floor(std::log10(std::abs(value)))), lost = power + 1 - digits;
  if (lost <= 0) return fmt::format("{:.{}f}", value, -lost);
  const double unit = std::pow(10, lost);
  return fmt::format("{:.0f}", unit * std::round(value / unit));
}

// Polynomials.

const std::vector<compensation::Term>& terms_of(const TrainedModel& trained) {
  return static_cast<const compensation::PolynomialModel&>(*trained.model).terms();
}

std::string named(const TrainingSettings& settings, int term, const Names& names) {
  return training::term_name(settings.terms[static_cast<std::size_t>(term)], names);
}

ordered_json p_values(const std::vector<double>& p, const TrainingSettings& settings, const Names& names) {
  ordered_json json = ordered_json::object();
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (std::isfinite(p[i])) json[named(settings, static_cast<int>(i), names)] = p[i];
  }
  return json;
}

ordered_json path_json(const training::PolynomialFit& result, const TrainingSettings& settings, const Names& names) {
  ordered_json path = ordered_json::array();
  for (const training::StepwiseStep& step : result.path) {
    ordered_json entry = {{"action", step.action}};
    if (step.term >= 0)
      entry.update({{"term", named(settings, step.term, names)},
                    {"p", finite_json(step.p)},
                    {"t", finite_json(step.t)},
                    {"F", finite_json(step.t * step.t)}});
    if (!step.candidate_p.empty()) entry["candidate_p"] = p_values(step.candidate_p, settings, names);
    if (!step.in_model_p.empty()) entry["in_model_p"] = p_values(step.in_model_p, settings, names);
    entry["terms"] = ordered_json::array();
    for (const int term : step.terms) entry["terms"].push_back(named(settings, term, names));
    path.push_back(std::move(entry));
  }
  return path;
}

ordered_json polynomial_json(const TrainedModel& trained, const TrainingSettings& settings, const Names& names) {
  ordered_json json = {{"coefficients", ordered_json::object()},
                       {"sse", trained.polynomial->fit.sse},
                       {"df", trained.polynomial->fit.df},
                       {"sd", trained.polynomial->fit.sd()},
                       {"condition", finite_json(trained.polynomial->condition)}};
  for (const compensation::Term& term : terms_of(trained))
    json["coefficients"][training::term_name(term.powers, names)] = term.coefficient;
  if (settings.method->has(training::kTerms)) json["path"] = path_json(*trained.polynomial, settings, names);
  return json;
}

std::string polynomial_text(const TrainedModel& trained, const TrainingSettings& settings, const Names& names) {
  std::string text =
      detail_line("coefficients", target_unit(trained) + " over the units of the term" +
                                      (trained.model->info().table ? "" : " (T degC, dTdt degC/s, U V)"));
  for (const compensation::Term& term : terms_of(trained))
    text += detail_line("", fmt::format("{:<10} {: .6g}", training::term_name(term.powers, names), term.coefficient));
  if (settings.method->has(training::kTerms)) {
    text += detail_line("steps", "p: probability that a term without effect improves the fit so much");
    for (const training::StepwiseStep& step : trained.polynomial->path) {
      if (step.term >= 0)
        text += detail_line(
            "", fmt::format("{:<7} {:<10} p {:.2g}", step.action, named(settings, step.term, names), step.p));
    }
  }
  text += detail_line("residual", plain_number(trained.polynomial->fit.sd(), 3) + " " + target_unit(trained) +
                                      ": 1 sigma that the model leaves in its own recording");
  return text + detail_line("condition", fmt::format("{:.3g}: above 1e8 the terms are almost the same",
                                                     trained.polynomial->condition));
}

// The paper's kernels.

/// "beta" or "delta"; nullptr if the weights have no parameter.
const char* parameter_name(const TrainingSettings& settings) {
  if (!settings.reweight.weight.has_parameter()) return nullptr;
  return settings.reweight.weight.kind == training::WeightKind::kHuber ? "beta" : "delta";
}

ordered_json kernel_json(const TrainedModel& trained, const TrainingSettings& settings) {
  const bool weights = settings.method->has(training::kWeights);
  ordered_json json;
  if (weights) {
    json["weight"] = training::weight_name(settings.reweight.weight.kind);
    json["reweight"] = settings.reweight.limit == 1 ? "1" : "converge";
  }
  json["c"] = trained.c;
  json["sigma2"] = trained.sigma2;
  if (const char* const name = parameter_name(settings)) json[name] = trained.parameter;
  json["cost"] = trained.tuning ? finite_json(trained.tuning->best.cost) : ordered_json(nullptr);
  json["centres"] = trained.centres;
  if (trained.reweight && weights) {
    const training::ReweightReport& r = *trained.reweight;
    json["reweighting"] = {{"solves", r.solves},
                           {"converged", r.converged},
                           {"oscillating", r.oscillating},
                           {"scale", finite_json(r.scale)},
                           {"dropped", r.dropped}};
  }
  if (!trained.tuning) return json;
  json["tuning"] = {{"evaluations", trained.tuning->evaluations},
                    {"stopped", trained.tuning->stopped},
                    {"surface", ordered_json::array()}};
  for (const training::TuningPoint& p : trained.tuning->surface) {
    json["tuning"]["surface"].push_back(
        {{"sigma2", p.sigma2}, {"c", p.c}, {"parameter", p.parameter}, {"cost", finite_json(p.cost)}});
  }
  return json;
}

std::string kernel_text(const TrainedModel& trained, const TrainingSettings& settings) {
  std::string kernel = fmt::format("c {}, sigma2 {}", plain_number(trained.c, 6), plain_number(trained.sigma2, 6));
  if (const char* const name = parameter_name(settings))
    kernel += fmt::format(", {} {}", name, plain_number(trained.parameter, 4));
  std::string text = detail_line("kernel", kernel + " (inputs in units of their standard deviation)");
  text += detail_line("centres", fmt::format("{} samples that the model contains", trained.centres));
  if (trained.tuning) {
    const bool likelihood = settings.tuning == training::Tuning::kReml;
    text += detail_line(
        "cost", fmt::format("{}{} ({}, {} evaluations{})", plain_number(trained.tuning->best.cost, 6),
                            likelihood ? ": minus the log-likelihood of a sample"
                                       : " " + target_unit(trained) + ": mean absolute error on held-out samples",
                            training::tuning_text(settings.tuning), trained.tuning->evaluations,
                            trained.tuning->stopped ? ", stopped early" : ""));
  }
  if (trained.reweight && settings.method->has(training::kWeights))
    text += detail_line("outliers", fmt::format("{} rounds of weights, {} samples left out", trained.reweight->solves,
                                                trained.reweight->dropped));
  return text;
}

// The composite kernel; variances in units of the target's variance.

const compensation::CompositeParameters& composite_of(const TrainedModel& trained) {
  return static_cast<const compensation::CompositeModel&>(*trained.model).parameters();
}

ordered_json composite_json(const TrainedModel& trained, const TrainingSettings& settings) {
  const compensation::CompositeVariances& v = composite_of(trained).variances;
  ordered_json json = {{"weight", training::weight_name(settings.reweight.weight.kind)}};
  json["variances"] = {{"smooth", v.kernel.rbf},
                       {"linear", v.kernel.linear},
                       {"quadratic", v.kernel.quadratic},
                       {"nuisance", v.nuisance},
                       {"nuisance_time_h", v.nuisance_time_h},
                       {"offset", v.offset},
                       {"noise", v.noise}};
  json["length_squared"] = std::vector<double>(v.kernel.length2.begin(), v.kernel.length2.end());
  json["skill"] = composite_of(trained).trust.skill;
  json["centres"] = trained.centres;
  json["reweighting"] = {{"solves", trained.reweight->solves}, {"converged", trained.reweight->converged}};
  return json;
}

std::string composite_text(const TrainedModel& trained) {
  const compensation::CompositeVariances& v = composite_of(trained).variances;
  const compensation::UncertaintySettings& trust = composite_of(trained).trust;
  const auto share = [](double variance) {
    return variance < 1e-3 ? std::string("0 %") : plain_number(100 * variance, 2) + " %";
  };
  constexpr double kConstant_h = 100;
  const std::string pace =
      v.nuisance_time_h > kConstant_h ? "slowly" : fmt::format("over {} h", plain_number(v.nuisance_time_h, 2));
  std::string text = detail_line(
      "skill",
      fmt::format("{:.2f}: how well each half of the recording predicts the other, 1 is perfectly; {:.2f} "
                  "with what one half cannot know. prismd uses the full prediction from {:g} on, only the mean "
                  "at {:g} or less",
                  trust.skill, compensation::evidence_of(trust.skill, trust.overlap), compensation::kFullSkill,
                  compensation::kNoSkill));
  text += detail_line("bias", fmt::format("shares of its variance: smooth {}, linear {}, quadratic {} in the inputs; "
                                          "drift in time {}, changing {}; noise {} (they may cancel each other, so one "
                                          "alone or the sum can exceed 100 %)",
                                          share(v.kernel.rbf), share(v.kernel.linear), share(v.kernel.quadratic),
                                          share(v.nuisance), pace, share(v.noise)));
  return text +
         detail_line("centres", fmt::format("{} samples that the model contains; {} rounds of weights against outliers",
                                            trained.centres, trained.reweight->solves));
}

// All methods.

ordered_json method_json(const TrainedModel& trained, const TrainingSettings& settings, const Names& names) {
  if (trained.polynomial) return polynomial_json(trained, settings, names);
  return settings.method->has(training::kOwnSearch) ? composite_json(trained, settings)
                                                    : kernel_json(trained, settings);
}

std::string method_text(const TrainedModel& trained, const TrainingSettings& settings, const Names& names) {
  if (trained.polynomial) return polynomial_text(trained, settings, names);
  return settings.method->has(training::kOwnSearch) ? composite_text(trained) : kernel_text(trained, settings);
}

ordered_json prior_json(const TrainedModel& trained) {
  const auto& prior = *composite_of(trained).prior;
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

std::string between_run_text(const TrainedModel& trained) {
  const std::optional<compensation::BetweenRunError>& error = trained.model->info().spread;
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
                  number(error->noise_deg_per_h), target_unit(trained), source, error->factor));
}

}  // namespace

ordered_json summary_json(const TrainedModel& trained, const TrainingSettings& settings, const Names& names) {
  ordered_json json = {
      {"method", settings.method->name}, {"inputs", names}, {"samples", trained.samples.fitted.size()}};
  if (trained.tuning) {
    json["tune"] = training::tuning_text(settings.tuning);
    json["folds"] =
        settings.tuning == training::Tuning::kGiven ? training::fold_count(*settings.given_folds) : settings.folds;
    json["seed"] = settings.seed;
  }
  json.update(method_json(trained, settings, names));
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

std::string summary_text(const TrainedModel& trained, const TrainingSettings& settings, const Names& names) {
  std::string text = detail_line("model", fmt::format("{} on {}: {} samples", settings.method->name,
                                                      fmt::join(names, ", "), trained.samples.fitted.size()));
  text += method_text(trained, settings, names);
  text += between_run_text(trained);
  if (trained.from_siblings) {
    const auto& prior = *composite_of(trained).prior;
    text += detail_line("prior", fmt::format("{} models of gyros of the same type, times {:.3g}: explain {:.0f} % of "
                                             "the variance of this recording",
                                             prior.models.size(), prior.scale, 100 * *trained.from_siblings));
  }
  for (const std::string& note : trained.notes) text += detail_line("note", note);
  return text;
}

}  // namespace prism::commands
