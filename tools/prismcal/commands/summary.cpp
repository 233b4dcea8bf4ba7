// SPDX-License-Identifier: MIT
// What a training came to, as JSON and as a few lines for people.
#include <fmt/format.h>

#include <cmath>

#include "compensation/composite_model.hpp"
#include "compensation/polynomial_model.hpp"
#include "tools/prismcal/commands/method_options.hpp"

namespace prism::commands {
namespace {

using nlohmann::ordered_json;

ordered_json finite_json(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr); }

std::string named(const training::TrainingSettings& settings, int term, const std::vector<std::string>& names) {
  return training::term_name(settings.terms[static_cast<std::size_t>(term)], names);
}

ordered_json coefficients_json(const training::TrainedModel& trained, const std::vector<std::string>& names) {
  ordered_json json = ordered_json::object();
  for (const compensation::Term& term : static_cast<const compensation::PolynomialModel&>(*trained.model).terms())
    json[training::term_name(term.powers, names)] = term.coefficient;
  return json;
}

ordered_json p_values(const std::vector<double>& p, const training::TrainingSettings& settings,
                      const std::vector<std::string>& names) {
  ordered_json json = ordered_json::object();
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (std::isfinite(p[i])) json[named(settings, static_cast<int>(i), names)] = p[i];
  }
  return json;
}

ordered_json path_json(const training::StepwiseResult& result, const training::TrainingSettings& settings,
                       const std::vector<std::string>& names) {
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

void add_kernel(ordered_json& json, const training::TrainedModel& trained, const training::TrainingSettings& settings) {
  json["c"] = trained.c;
  json["sigma2"] = trained.sigma2;
  if (settings.reweight.weight.kind == training::WeightKind::kHuber) json["beta"] = trained.parameter;
  if (settings.reweight.weight.kind == training::WeightKind::kMyriad) json["delta"] = trained.parameter;
  json["cost"] = trained.tuning ? finite_json(trained.tuning->best.cost) : ordered_json(nullptr);
  json["centres"] = trained.centres;
  if (trained.reweight && settings.method == training::Method::kIrlssvm) {
    const training::ReweightReport& r = *trained.reweight;
    json["reweighting"] = {{"solves", r.solves},
                           {"converged", r.converged},
                           {"oscillating", r.oscillating},
                           {"scale", finite_json(r.scale)},
                           {"dropped", r.dropped}};
  }
  if (!trained.tuning) return;
  json["tuning"] = {{"evaluations", trained.tuning->evaluations},
                    {"stopped", trained.tuning->stopped},
                    {"surface", ordered_json::array()}};
  for (const training::TuningPoint& p : trained.tuning->surface) {
    json["tuning"]["surface"].push_back(
        {{"sigma2", p.sigma2}, {"c", p.c}, {"parameter", p.parameter}, {"cost", finite_json(p.cost)}});
  }
}

// Variances in units of the target's own.
void add_composite(ordered_json& json, const training::TrainedModel& trained) {
  const auto& p = static_cast<const compensation::CompositeModel&>(*trained.model).parameters();
  const compensation::CompositeVariances& v = p.variances;
  json["variances"] = {{"smooth", v.kernel.rbf},
                       {"linear", v.kernel.linear},
                       {"quadratic", v.kernel.quadratic},
                       {"nuisance", v.nuisance},
                       {"nuisance_time_h", v.nuisance_time_h},
                       {"offset", v.offset},
                       {"noise", v.noise}};
  json["length_squared"] = std::vector<double>(v.kernel.length2.begin(), v.kernel.length2.end());
  json["skill"] = p.trust.skill;
  json["centres"] = trained.centres;
  json["reweighting"] = {{"solves", trained.reweight->solves}, {"converged", trained.reweight->converged}};
}

ordered_json prior_json(const training::TrainedModel& trained) {
  const auto& prior = *static_cast<const compensation::CompositeModel&>(*trained.model).parameters().prior;
  ordered_json ids = ordered_json::array();
  for (const compensation::ModelPtr& sibling : prior.models) ids.push_back(sibling->info().id);
  return {{"scale", prior.scale}, {"explained", *trained.from_siblings}, {"models", std::move(ids)}};
}

ordered_json spread_json(const std::optional<compensation::Spread>& spread) {
  if (!spread) return nullptr;
  return {{"nuisance_deg_per_h", spread->nuisance_deg_per_h},
          {"offset_deg_per_h", spread->offset_deg_per_h},
          {"noise_deg_per_h", spread->noise_deg_per_h},
          {"factor", spread->factor},
          {"blocks", spread->blocks},
          {"samples", spread->samples}};
}

std::string spread_text(const std::optional<compensation::Spread>& spread) {
  if (!spread) return "  too short a record to say how far another run lies from this model\n";
  const std::string judged = spread->blocks > 0
                                 ? fmt::format("{} held-out parts, {} samples", spread->blocks, spread->samples)
                                 : std::string("its own likelihood");
  return fmt::format(
      "  another run: nuisance {:.3g}, offset {:.3g}, noise of a mean {:.3g} deg/h, all times {:.2f} (by {})\n",
      spread->nuisance_deg_per_h, spread->offset_deg_per_h, spread->noise_deg_per_h, spread->factor, judged);
}

std::string composite_text(const training::TrainedModel& trained) {
  const auto& p = static_cast<const compensation::CompositeModel&>(*trained.model).parameters();
  const compensation::CompositeVariances& v = p.variances;
  return fmt::format(
      "  variances (of the target's): smooth {:.3g}, linear {:.3g}, quadratic {:.3g}, drift in time {:.3g} ({:.2g} h), "
      "noise {:.3g}\n  skill of each half on the other {:.2f}; {} centres, {} re-weightings\n",
      v.kernel.rbf, v.kernel.linear, v.kernel.quadratic, v.nuisance, v.nuisance_time_h, v.noise, p.trust.skill,
      trained.centres, trained.reweight->solves);
}

void add_polynomial(ordered_json& json, const training::TrainedModel& trained,
                    const training::TrainingSettings& settings, const std::vector<std::string>& names) {
  json["coefficients"] = coefficients_json(trained, names);
  json["sse"] = trained.linear->sse;
  json["df"] = trained.linear->df;
  json["sd"] = trained.linear->sd();
  json["condition"] = finite_json(trained.condition);
  if (trained.stepwise) json["path"] = path_json(*trained.stepwise, settings, names);
}

const char* tuning_words(training::Tuning tuning) {
  switch (tuning) {
    case training::Tuning::kBlocked:
      return "blocked folds";
    case training::Tuning::kShuffled:
      return "shuffled folds";
    case training::Tuning::kGiven:
      return "given folds";
    case training::Tuning::kLoo:
      return "leave-one-out";
    default:
      return "reml";
  }
}

}  // namespace

ordered_json summary_json(const training::TrainedModel& trained, const training::TrainingSettings& settings,
                          const std::vector<std::string>& names) {
  ordered_json json = {{"method", training::method_name(settings.method)},
                       {"inputs", names},
                       {"samples", trained.samples.fitted.size()}};
  if (settings.method == training::Method::kIrlssvm) {
    json["weight"] = training::weight_name(settings.reweight.weight.kind);
    json["reweight"] = settings.reweight.limit == 1 ? "1" : "converge";
  }
  if (trained.tuning) {
    json["tune"] = tuning_words(settings.tuning);
    json["folds"] =
        settings.tuning == training::Tuning::kGiven ? training::fold_count(*settings.given_folds) : settings.folds;
    json["seed"] = settings.seed;
  }
  if (settings.method == training::Method::kComposite) {
    json["weight"] = training::weight_name(settings.reweight.weight.kind);
    add_composite(json, trained);
  } else {
    trained.linear ? add_polynomial(json, trained, settings, names) : add_kernel(json, trained, settings);
  }
  json["spread"] = spread_json(trained.model->info().spread);
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
  std::string text = fmt::format("{} on {}: {} samples\n", training::method_name(settings.method),
                                 fmt::join(names, ", "), trained.samples.fitted.size());
  if (settings.method == training::Method::kComposite) {
    text += composite_text(trained);
  } else if (trained.linear) {
    for (const compensation::Term& term : static_cast<const compensation::PolynomialModel&>(*trained.model).terms()) {
      text += fmt::format("  {:<12} {: .6g}\n", training::term_name(term.powers, names), term.coefficient);
    }
    if (trained.stepwise) {
      for (const training::StepwiseStep& step : trained.stepwise->path) {
        if (step.term >= 0)
          text += fmt::format("  {:<7} {:<10} p {:.3g}\n", step.action, named(settings, step.term, names), step.p);
      }
    }
    text += fmt::format("  residual sd {:.6g}, condition number {:.3g}\n", trained.linear->sd(), trained.condition);
  } else {
    text += fmt::format("  c {:.6g}, sigma2 {:.6g}", trained.c, trained.sigma2);
    if (settings.reweight.weight.has_parameter() && settings.method == training::Method::kIrlssvm) {
      text +=
          fmt::format(", {} {:.4g}", settings.reweight.weight.kind == training::WeightKind::kHuber ? "beta" : "delta",
                      trained.parameter);
    }
    text += fmt::format(", {} centres\n", trained.centres);
    if (trained.tuning) {
      text += fmt::format("  cost {:.6g} ({}, {} evaluations{})\n", trained.tuning->best.cost,
                          tuning_words(settings.tuning), trained.tuning->evaluations,
                          trained.tuning->stopped ? ", stopped early" : "");
    }
    if (trained.reweight && settings.method == training::Method::kIrlssvm) {
      text += fmt::format("  {} re-weightings, scale {:.4g} (normalised), {} samples dropped\n",
                          trained.reweight->solves, trained.reweight->scale, trained.reweight->dropped);
    }
  }
  text += spread_text(trained.model->info().spread);
  if (trained.from_siblings) {
    const auto& prior = *static_cast<const compensation::CompositeModel&>(*trained.model).parameters().prior;
    text += fmt::format("  {} siblings, scale {:.3g}: they explain {:.0f} % of the variance of this record\n",
                        prior.models.size(), prior.scale, 100 * *trained.from_siblings);
  }
  for (const std::string& note : trained.notes) text += "  note: " + note + "\n";
  return text;
}

}  // namespace prism::commands
