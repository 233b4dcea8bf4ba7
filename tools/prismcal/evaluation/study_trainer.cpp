// SPDX-License-Identifier: MIT
#include "tools/prismcal/evaluation/study_trainer.hpp"

#include <fmt/format.h>

#include "compensation/polynomial_model.hpp"
#include "compensation/training/trainer.hpp"

namespace prism {
namespace {

TrainingData data_of(const BlockTable& table, const std::vector<std::string>& inputs) {
  TrainingData data;
  data.names = inputs;
  data.inputs.resize(static_cast<Eigen::Index>(inputs.size()), static_cast<Eigen::Index>(table.size()));
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const auto column = table.column(inputs[i]);
    data.inputs.row(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::RowVectorXd>(column.data(), static_cast<Eigen::Index>(column.size()));
  }
  data.target = Eigen::Map<const Eigen::VectorXd>(table.bias_deg_per_h.data(), static_cast<Eigen::Index>(table.size()));
  int run = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (i > 0 && !table.follows[i]) ++run;
    data.runs.push_back(run);
  }
  return data;
}

Result<TrainingSettings> settings_of(const ModelSpec& spec, const StudyTraining& study) {
  TrainingSettings settings;
  const auto method = parse_method(spec.method);
  if (!method) return tl::unexpected(method.error());
  settings.method = *method;
  if (*method == Method::kLeastSquares) settings.terms = cubic_terms();
  if (*method == Method::kStepwise) {
    settings.terms = second_order_terms(spec.inputs.size());
    settings.stepwise.start = {0, 1, 2};  // T, T², dT/dt: what the paper starts from
  }
  if (!spec.weight.empty()) {
    const auto weight = parse_weight(spec.weight);
    if (!weight) return tl::unexpected(weight.error());
    settings.reweight.weight.kind = *weight;
  }
  settings.reweight.limit = study.reweight_limit;
  settings.tuning = spec.tune == "shuffled" ? Tuning::kShuffled
                    : spec.tune == "loo"    ? Tuning::kLoo
                    : spec.tune == "reml"   ? Tuning::kReml
                                            : Tuning::kBlocked;
  settings.folds = study.folds;
  settings.seed = study.seed;
  settings.threads = 1;  // the study trains several models at a time
  return settings;
}

/// What stepwise did, a line for each step.
std::vector<std::string> trace_of(const StepwiseResult& result, const TermPowers& terms,
                                  const std::vector<std::string>& names) {
  std::vector<std::string> lines;
  for (const StepwiseStep& step : result.path) {
    std::string line = step.action;
    if (step.term >= 0)
      line += fmt::format(" {} (p = {:.3g})", term_name(terms[static_cast<std::size_t>(step.term)], names), step.p);
    lines.push_back(std::move(line));
  }
  return lines;
}

Trained told(TrainedModel&& made, const ModelSpec& spec, const TrainingSettings& settings) {
  Trained trained;
  trained.model = made.model;
  trained.warnings = made.notes;
  if (const auto* polynomial = dynamic_cast<const PolynomialModel*>(made.model.get())) {
    for (const Term& term : polynomial->terms())
      trained.terms.emplace_back(term_name(term.powers, spec.inputs), term.coefficient);
    if (made.stepwise) trained.trace = trace_of(*made.stepwise, settings.terms, spec.inputs);
    return trained;
  }
  trained.c = made.c;
  trained.sigma2 = made.sigma2;
  if (settings.reweight.weight.has_parameter()) trained.parameter = made.parameter;
  if (made.tuning && settings.tuning != Tuning::kReml) {  // a likelihood is no error in deg/h
    trained.cost_deg_per_h = made.tuning->best.cost;
    for (const TuningPoint& point : made.tuning->surface)
      trained.surface.push_back({point.c, point.sigma2, point.cost});
  }
  if (!spec.weight.empty()) trained.weights.assign(made.samples.weight.begin(), made.samples.weight.end());
  return trained;
}

}  // namespace

Trainer study_trainer(StudyTraining study) {
  return [study](const BlockTable& training, const ModelSpec& spec) -> Result<Trained> {
    const auto settings = settings_of(spec, study);
    if (!settings) return tl::unexpected(settings.error());
    ModelInfo info;
    info.name = spec.key();
    info.features = training.features;
    info.gyro_serial = study.gyro_serial;
    auto made = train(data_of(training, spec.inputs), std::move(info), *settings, {}, study.stop);
    if (study.stop && study.stop->load()) return refuse("tuning", "interrupted");
    if (!made) return tl::unexpected(made.error());
    return told(std::move(*made), spec, *settings);
  };
}

}  // namespace prism
