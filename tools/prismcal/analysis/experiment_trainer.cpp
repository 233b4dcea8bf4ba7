// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "compensation/polynomial_model.hpp"
#include "compensation/training/methods.hpp"
#include "tools/prismcal/analysis/experiment.hpp"

namespace prism::analysis {
namespace {

training::TrainingData data_of(const recordings::BlockTable& table, const std::vector<std::string>& inputs) {
  training::TrainingData data;
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

Result<training::TrainingSettings> settings_of(const ModelSpec& spec, const ExperimentSettings& experiment) {
  training::TrainingSettings settings;
  const auto method = training::parse_method(spec.method);
  if (!method) return tl::unexpected(method.error());
  settings.method = *method;
  if ((*method)->has(training::kCubic)) settings.terms = training::cubic_terms();
  if ((*method)->has(training::kTerms)) {
    settings.terms = training::second_order_terms(spec.inputs.size());
    settings.stepwise.start = {0, 1, 2};  // T, T², dT/dt, as in the paper
  }
  if (!spec.weight.empty()) {
    const auto weight = training::parse_weight(spec.weight);
    if (!weight) return tl::unexpected(weight.error());
    settings.reweight.weight.kind = *weight;
  }
  settings.reweight.limit = experiment.reweight_limit;
  settings.tuning = training::tuning_by_name(spec.tune);
  settings.folds = experiment.folds;
  settings.seed = experiment.seed;
  settings.threads = 1;  // the experiment trains several models in parallel
  return settings;
}

/// The path of the stepwise regression, one line per step.
std::vector<std::string> trace_of(const training::StepwiseResult& result, const training::TermPowers& terms,
                                  const std::vector<std::string>& names) {
  std::vector<std::string> lines;
  for (const training::StepwiseStep& step : result.path) {
    std::string line = step.action;
    if (step.term >= 0)
      line += fmt::format(" {} (p = {:.3g})", training::term_name(terms[static_cast<std::size_t>(step.term)], names),
                          step.p);
    lines.push_back(std::move(line));
  }
  return lines;
}

Trained convert(training::TrainedModel&& made, const ModelSpec& spec, const training::TrainingSettings& settings) {
  Trained trained;
  trained.model = made.model;
  trained.warnings = made.notes;
  if (const auto* polynomial = dynamic_cast<const compensation::PolynomialModel*>(made.model.get())) {
    for (const compensation::Term& term : polynomial->terms())
      trained.terms.emplace_back(training::term_name(term.powers, spec.inputs), term.coefficient);
    if (made.stepwise) trained.trace = trace_of(*made.stepwise, settings.terms, spec.inputs);
    return trained;
  }
  trained.c = made.c;
  trained.sigma2 = made.sigma2;
  if (settings.reweight.weight.has_parameter()) trained.parameter = made.parameter;
  if (made.tuning && settings.tuning != training::Tuning::kReml) {  // a likelihood is not an error in deg/h
    trained.cost_deg_per_h = made.tuning->best.cost;
    for (const training::TuningPoint& point : made.tuning->surface)
      trained.surface.push_back({point.c, point.sigma2, point.cost});
  }
  if (!spec.weight.empty()) trained.weights.assign(made.samples.weight.begin(), made.samples.weight.end());
  return trained;
}

}  // namespace

Trainer experiment_trainer(ExperimentSettings experiment) {
  return [experiment](const recordings::BlockTable& training, const ModelSpec& spec) -> Result<Trained> {
    const auto settings = settings_of(spec, experiment);
    if (!settings) return tl::unexpected(settings.error());
    compensation::ModelInfo info;
    info.name = spec.key();
    info.features = training.features;
    info.gyro_serial = experiment.gyro_serial;
    auto made = training::train(data_of(training, spec.inputs), std::move(info), *settings, {}, experiment.stop);
    if (experiment.stop && experiment.stop->load()) return make_error("tuning", "interrupted");
    if (!made) return tl::unexpected(made.error());
    return convert(std::move(*made), spec, *settings);
  };
}

}  // namespace prism::analysis
