// SPDX-License-Identifier: MIT
#include "tools/prismcal/method_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "compensation/composite_model.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/polynomial_model.hpp"
#include "compensation/training/trainer.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::commands {
namespace {

std::string default_method() { return training::TrainingSettings().method->name; }

std::vector<std::string> known_methods() {
  std::vector<std::string> names;
  for (const training::Method& method : training::methods()) names.emplace_back(method.name);
  return names;
}

}  // namespace

void add_method_options(CLI::App& command, MethodOptions& o) {
  using training::method_names;
  const std::string terms = method_names(training::kTerms) + ": ";
  add_options(command, {{"--method", &o.method,
                         fmt::format("{} (default: {}; {} with --c, --sigma2 or --tune)", method_names(~0U, " or "),
                                     default_method(), kDefaultTuned),
                         one_of(known_methods())},
                        {"--json", &o.json, "print JSON"},
                        {"--quiet", &o.quiet, "no progress on stderr"}});
  add_options(
      command,
      {{"--weight", &o.weight, method_names(training::kWeights) + ": huber, hampel, logistic or myriad (default)",
        one_of({"huber", "hampel", "logistic", "myriad"})},
       {"--c", &o.settings.c, "regularisation, normalised units; with --sigma2: no tuning", tools::positive()},
       {"--sigma2", &o.settings.sigma2, "kernel width squared, normalised units", tools::positive()},
       {"--beta", &o.beta, "Huber's parameter", tools::positive()},
       {"--delta", &o.delta, "myriad's parameter", tools::positive()},
       {"--epsilon", &o.settings.epsilon,
        method_names(training::kTube) + ": half width of the tube, in sd of the target", tools::not_negative()},
       {"--tune", &o.tune,
        method_names(training::kTuning) + (o.tune.empty() ? ": blocked (folds; default), shuffled (folds), loo or reml"
                                                          : ": blocked (folds), shuffled (folds), loo or reml"),
        one_of({"blocked", "shuffled", "loo", "reml"})},
       {"--folds", &o.settings.folds, "number of folds", tools::within(2, 1000000)},
       {"--reweight", &o.reweight, "1 (the paper) or converge", one_of({"1", "converge"})},
       {"--scale", &o.scale, "scale estimate of the residuals: mad or iqr", one_of({"mad", "iqr"})},
       {"--hampel-floor", &o.settings.reweight.weight.hampel_floor,
        "Hampel's weight of far outliers; 0 drops the sample", tools::within(0, 1)},
       {"--drift", &o.drift,
        method_names(training::kDrift) + ": thermal (default: what one passage cannot decide is mostly thermal), open "
                                         "(the record decides) or none (no drift in time)",
        one_of({"thermal", "open", "none"})},
       {"--normalise", &o.normalise, "zscore, auto (by column, as LS-SVMlab) or none",
        one_of({"zscore", "auto", "none"})},
       {"--seed", &o.settings.seed, "seed of the random generator", tools::within(0, 1e15)},
       {"--threads", &o.settings.threads, "maximum number of threads", tools::within(1, 64)},
       {"--start", &o.start, terms + "initial terms, or none"},
       {"--p-enter", &o.settings.stepwise.p_enter, terms + "p below which a term is added", tools::within(0, 1)},
       {"--p-remove", &o.settings.stepwise.p_remove, terms + "p above which a term is removed", tools::within(0, 1)},
       {"--memory", &o.memory_mb, "memory limit of training, MB", tools::positive()}},
      Need::kFew);
}

std::string method_name_of(const MethodOptions& options) {
  if (!options.method.empty()) return options.method;
  const training::TrainingSettings& s = options.settings;
  return s.c || s.sigma2 || !options.tune.empty() ? kDefaultTuned : default_method();
}

Result<training::TrainingSettings> settings_of(const MethodOptions& o) {
  training::TrainingSettings s = o.settings;
  s.method = training::find_method(method_name_of(o));
  if (s.method->has(training::kOwnSearch) && (s.c || s.sigma2 || !o.tune.empty()))
    return make_error("--method", fmt::format("found {} with --c, --sigma2 or --tune, which need {}", s.method->name,
                                              training::method_names(training::kTuning, " and ")));
  s.reweight.weight.kind = training::WeightKind::kNone;
  if (s.method->has(training::kWeights)) {
    s.reweight.weight.kind = training::weight_by_name(o.weight.empty() ? "myriad" : o.weight);
  } else if (!o.weight.empty()) {
    return make_error("--weight", fmt::format("found \"{}\" with --method {}, expected it with {}", o.weight,
                                              s.method->name, training::method_names(training::kWeights, " or ")));
  }
  if (o.beta && s.reweight.weight.kind != training::WeightKind::kHuber)
    return make_error("--beta", "found it without --weight huber");
  if (o.delta && s.reweight.weight.kind != training::WeightKind::kMyriad)
    return make_error("--delta", "found it without --weight myriad");
  if (!o.drift.empty() && !s.method->has(training::kDrift))
    return make_error("--drift", fmt::format("found \"{}\" with --method {}, expected it with {}", o.drift,
                                             s.method->name, training::method_names(training::kDrift, " or ")));
  s.drift = o.drift == "open"   ? training::Drift::kOpen
            : o.drift == "none" ? training::Drift::kNone
                                : training::Drift::kThermal;
  s.parameter = o.beta ? o.beta : o.delta;
  s.reweight.scale = o.scale == "mad" ? training::ScaleKind::kMad : training::ScaleKind::kIqr;
  if (o.reweight == "1") s.reweight.limit = 1;
  s.scaling = o.normalise == "zscore" ? training::NormalisationMethod::kZscore
              : o.normalise == "auto" ? training::NormalisationMethod::kAuto
                                      : training::NormalisationMethod::kNone;
  s.tuning = training::tuning_by_name(o.tune.empty() ? "blocked" : o.tune);
  s.memory_limit_bytes = o.memory_mb * 1e6;
  return s;
}

Result<void> set_terms(const MethodOptions& options, const std::vector<std::string>& names,
                       training::TrainingSettings& settings) {
  if (settings.method->has(training::kCubic)) {
    if (names.size() != 1)
      return make_error("--inputs",
                        fmt::format("found {} with --method {}, expected one: the model is a cubic of one input",
                                    names.size(), settings.method->name));
    settings.terms = training::cubic_terms();
  }
  if (!settings.method->has(training::kTerms)) return {};
  settings.terms = options.table ? training::plain_terms(names.size()) : training::second_order_terms(names.size());
  std::vector<std::string> start;
  if (!options.table) start = {"T", "T^2", "dTdt"};
  std::vector<std::string> known;
  for (const auto& powers : settings.terms) known.push_back(training::term_name(powers, names));
  if (!options.start.empty()) start = tables::list_items(options.start == "none" ? "" : options.start);
  for (const std::string& wanted : start) {
    const auto at = std::ranges::find(known, wanted);
    if (at != known.end()) settings.stepwise.start.push_back(static_cast<int>(at - known.begin()));
    if (at == known.end() && !options.start.empty())
      return make_error("--start", fmt::format("found \"{}\", expected terms of {}", wanted, fmt::join(known, ", ")));
  }
  return {};
}

// The result of a training as JSON and as readable lines.

namespace {

using nlohmann::ordered_json;
using training::TrainedModel, training::TrainingSettings;
using Names = std::vector<std::string>;

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

void add_path(const training::PolynomialFit& result, const TrainingSettings& settings, const Names& names,
              Summary& summary) {
  summary.json["path"] = ordered_json::array();
  summary.line("steps", "p: probability that a term without effect improves the fit so much");
  for (const training::StepwiseStep& step : result.path) {
    ordered_json entry = {{"action", step.action}};
    if (step.term >= 0) {
      entry.update({{"term", named(settings, step.term, names)}, {"p", step.p}, {"t", step.t}, {"F", step.t * step.t}});
      summary.line("", fmt::format("{:<7} {:<10} p {:.2g}", step.action, named(settings, step.term, names), step.p));
    }
    if (!step.candidate_p.empty()) entry["candidate_p"] = p_values(step.candidate_p, settings, names);
    if (!step.in_model_p.empty()) entry["in_model_p"] = p_values(step.in_model_p, settings, names);
    entry["terms"] = ordered_json::array();
    for (const int term : step.terms) entry["terms"].push_back(named(settings, term, names));
    summary.json["path"].push_back(std::move(entry));
  }
}

void add_polynomial(const TrainedModel& trained, const TrainingSettings& settings, const Names& names,
                    Summary& summary) {
  const training::PolynomialFit& found = *trained.polynomial;
  summary.json.update({{"coefficients", ordered_json::object()},
                       {"sse", found.fit.sse},
                       {"df", found.fit.df},
                       {"sd", found.fit.sd()},
                       {"condition", found.condition}});
  summary.line("coefficients", target_unit(trained) + " over the units of the term" +
                                   (trained.model->info().table ? "" : " (T degC, dTdt degC/s, U V)"));
  for (const compensation::Term& term : static_cast<const compensation::PolynomialModel&>(*trained.model).terms()) {
    const std::string name = training::term_name(term.powers, names);
    summary.json["coefficients"][name] = term.coefficient;
    summary.line("", fmt::format("{:<10} {: .6g}", name, term.coefficient));
  }
  if (settings.method->has(training::kTerms)) add_path(found, settings, names, summary);
  summary.line("residual", plain_number(found.fit.sd(), 3) + " " + target_unit(trained) +
                               ": 1 sigma that the model leaves in its own recording");
  summary.line("condition", fmt::format("{:.3g}: above 1e8 the terms are almost the same", found.condition));
}

// The paper's kernels.

void add_tuning(const TrainedModel& trained, const TrainingSettings& settings, Summary& summary) {
  const training::TuningResult& tuning = *trained.tuning;
  ordered_json& json = summary.json["tuning"] = {
      {"evaluations", tuning.evaluations}, {"stopped", tuning.stopped}, {"surface", ordered_json::array()}};
  for (const training::TuningPoint& p : tuning.surface)
    json["surface"].push_back({{"sigma2", p.sigma2}, {"c", p.c}, {"parameter", p.parameter}, {"cost", p.cost}});
  const bool likelihood = settings.tuning == training::Tuning::kReml;
  summary.line(
      "cost",
      fmt::format("{}{} ({}, {} evaluations{})", plain_number(tuning.best.cost, 6),
                  likelihood ? ": minus the log-likelihood of a sample"
                             : " " + target_unit(trained) + ": mean absolute error on held-out samples",
                  training::tuning_text(settings.tuning), tuning.evaluations, tuning.stopped ? ", stopped early" : ""));
}

void add_kernel(const TrainedModel& trained, const TrainingSettings& settings, Summary& summary) {
  const bool weights = settings.method->has(training::kWeights);
  const training::WeightFunction& weight = settings.reweight.weight;
  ordered_json& json = summary.json;
  if (weights) {
    json["weight"] = training::weight_name(weight.kind);
    json["reweight"] = settings.reweight.limit == 1 ? "1" : "converge";
  }
  json["c"] = trained.c;
  json["sigma2"] = trained.sigma2;
  std::string kernel = fmt::format("c {}, sigma2 {}", plain_number(trained.c, 6), plain_number(trained.sigma2, 6));
  if (weight.has_parameter()) {
    const char* const name = weight.kind == training::WeightKind::kHuber ? "beta" : "delta";
    json[name] = trained.parameter;
    kernel += fmt::format(", {} {}", name, plain_number(trained.parameter, 4));
  }
  json["cost"] = trained.tuning ? ordered_json(trained.tuning->best.cost) : ordered_json();
  json["centres"] = trained.centres;
  summary.line("kernel", kernel + " (inputs in units of their standard deviation)");
  summary.line("centres", fmt::format("{} samples that the model contains", trained.centres));
  const bool reweighted = trained.reweight && weights;
  if (reweighted)
    json["reweighting"] = {{"solves", trained.reweight->solves},
                           {"converged", trained.reweight->converged},
                           {"oscillating", trained.reweight->oscillating},
                           {"scale", trained.reweight->scale},
                           {"dropped", trained.reweight->dropped}};
  if (trained.tuning) add_tuning(trained, settings, summary);
  if (reweighted)
    summary.line("outliers", fmt::format("{} rounds of weights, {} samples left out", trained.reweight->solves,
                                         trained.reweight->dropped));
}

// The composite kernel; variances in units of the target's variance.

const compensation::CompositeParameters& composite_of(const TrainedModel& trained) {
  return static_cast<const compensation::CompositeModel&>(*trained.model).parameters();
}

void add_composite(const TrainedModel& trained, const TrainingSettings& settings, Summary& summary) {
  const compensation::CompositeVariances& v = composite_of(trained).variances;
  const compensation::UncertaintySettings& trust = composite_of(trained).trust;
  ordered_json& json = summary.json;
  json["weight"] = training::weight_name(settings.reweight.weight.kind);
  json["variances"] = {{"smooth", v.kernel.rbf},
                       {"linear", v.kernel.linear},
                       {"quadratic", v.kernel.quadratic},
                       {"nuisance", v.nuisance},
                       {"nuisance_time_h", v.nuisance_time_h},
                       {"offset", v.offset},
                       {"noise", v.noise}};
  json["length_squared"] = std::vector<double>(v.kernel.length2.begin(), v.kernel.length2.end());
  json["skill"] = trust.skill;
  json["centres"] = trained.centres;
  json["reweighting"] = {{"solves", trained.reweight->solves}, {"converged", trained.reweight->converged}};
  const auto share = [](double variance) {
    return variance < 1e-3 ? std::string("0 %") : plain_number(100 * variance, 2) + " %";
  };
  constexpr double kConstant_h = 100;
  const std::string pace =
      v.nuisance_time_h > kConstant_h ? "slowly" : fmt::format("over {} h", plain_number(v.nuisance_time_h, 2));
  summary.line(
      "skill",
      fmt::format("{:.2f}: how well each half of the recording predicts the other, 1 is perfectly; {:.2f} "
                  "with what one half cannot know. prismd uses the full prediction from {:g} on, only the mean "
                  "at {:g} or less",
                  trust.skill, compensation::evidence_of(trust.skill, trust.overlap), compensation::kFullSkill,
                  compensation::kNoSkill));
  summary.line("bias", fmt::format("shares of its variance: smooth {}, linear {}, quadratic {} in the inputs; "
                                   "drift in time {}, changing {}; noise {} (they may cancel each other, so one "
                                   "alone or the sum can exceed 100 %)",
                                   share(v.kernel.rbf), share(v.kernel.linear), share(v.kernel.quadratic),
                                   share(v.nuisance), pace, share(v.noise)));
  summary.line("centres", fmt::format("{} samples that the model contains; {} rounds of weights against outliers",
                                      trained.centres, trained.reweight->solves));
}

// All methods.

void add_between_runs(const TrainedModel& trained, Summary& summary) {
  const std::optional<compensation::BetweenRunError>& error = trained.model->info().spread;
  if (!error) {
    summary.json["spread"] = nullptr;
    return summary.line("another run", "not estimated: the recording is too short");
  }
  summary.json["spread"] = {{"nuisance_deg_per_h", error->nuisance_deg_per_h},
                            {"offset_deg_per_h", error->offset_deg_per_h},
                            {"noise_deg_per_h", error->noise_deg_per_h},
                            {"factor", error->factor},
                            {"blocks", error->blocks},
                            {"samples", error->samples}};
  const std::string source = error->blocks > 0
                                 ? fmt::format("{} held-out parts, {} samples", error->blocks, error->samples)
                                 : std::string("its likelihood");
  const auto number = [&](double value) { return plain_number(error->factor * value, 2); };
  // One record does not show how runs differ.
  const char* const prior = error->offset_deg_per_h > 0 ? " (a prior: one recording does not show it)" : "";
  summary.line("another run",
               fmt::format("1 sigma of the errors to expect: unexplained drift {}, constant offset {}{}, noise of a "
                           "mean {} {} (from {}; factor {:.2f})",
                           number(error->nuisance_deg_per_h), number(error->offset_deg_per_h), prior,
                           number(error->noise_deg_per_h), target_unit(trained), source, error->factor));
}

void add_prior(const TrainedModel& trained, Summary& summary) {
  const auto& prior = *composite_of(trained).prior;
  ordered_json ids = ordered_json::array();
  for (const compensation::ModelPtr& model : prior.models) ids.push_back(model->info().id);
  summary.json["prior"] = {{"scale", prior.scale}, {"explained", *trained.from_siblings}, {"models", std::move(ids)}};
  summary.line("prior", fmt::format("{} models of gyros of the same type, times {:.3g}: explain {:.0f} % of "
                                    "the variance of this recording",
                                    prior.models.size(), prior.scale, 100 * *trained.from_siblings));
}

}  // namespace

void Summary::line(const std::string& name, const std::string& value) {
  text += fmt::format("  {:<14} {}\n", name, value);
}

Summary summary_of(const TrainedModel& trained, const TrainingSettings& settings, const Names& names) {
  Summary summary{{{"method", settings.method->name}, {"inputs", names}, {"samples", trained.samples.fitted.size()}},
                  {}};
  summary.line("model", fmt::format("{} on {}: {} samples", settings.method->name, fmt::join(names, ", "),
                                    trained.samples.fitted.size()));
  if (trained.tuning) {
    summary.json["tune"] = training::tuning_text(settings.tuning);
    summary.json["folds"] =
        settings.tuning == training::Tuning::kGiven ? training::fold_count(*settings.given_folds) : settings.folds;
    summary.json["seed"] = settings.seed;
  }
  if (trained.polynomial) {
    add_polynomial(trained, settings, names, summary);
  } else if (settings.method->has(training::kOwnSearch)) {
    add_composite(trained, settings, summary);
  } else {
    add_kernel(trained, settings, summary);
  }
  add_between_runs(trained, summary);
  if (trained.from_siblings) add_prior(trained, summary);
  for (const std::string& note : trained.notes) summary.line("note", note);
  summary.json["warnings"] = trained.notes;
  summary.json["id"] = trained.model->info().id;
  return summary;
}

ordered_json provenance_json(ordered_json summary) {
  summary.erase("id");
  if (summary.contains("tuning")) summary["tuning"].erase("surface");
  return summary;
}

}  // namespace prism::commands
