// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/experiment_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tools/prismcal/analysis/recording_report.hpp"

namespace prism::analysis {
namespace {

using report::Emphasis;
using report::Paragraph;
using report::Section;

/// Sum over the evaluated recordings of sigma after / sigma before; lower is better.
double relative_sum(const ExperimentRow& row) {
  double sum = 0;
  for (const ModelEvaluation& evaluated : row.evaluations)
    sum += evaluated.stability.after.sd / evaluated.stability.before.sd;
  return sum;
}

bool is_usual(const ModelSpec& spec) { return spec.weight == kUsualWeight && spec.tune == kUsualTune; }

std::vector<std::string> worse_than_uncompensated(const Experiment& experiment, std::size_t recording) {
  std::vector<std::string> worse;
  for (const ExperimentRow& row : experiment.rows) {
    if (row.evaluations[recording].stability.improvement.value_or(0) >= 0) continue;
    const std::string tuned = row.spec.tune.empty() ? "" : fmt::format(" ({})", tune_text(row.spec.tune));
    worse.push_back(fmt::format("{} on {}{}", method_text(row.spec), row.spec.inputs_text(), tuned));
  }
  return worse;
}

Section summary(const Experiment& experiment) {
  Section section{"summary", "Summary", {}};
  const ExperimentRow& chosen = *chosen_row(experiment);
  const evaluation::BiasStability& repeat = on_repeat(chosen);
  std::string text = fmt::format(
      "{} on {}, tuned by {}, reduces the bias stability of the repeated profile by {:.1f} %: {:.5f} → {:.5f} deg/h.",
      method_text(chosen.spec), chosen.spec.inputs_text(), tune_text(chosen.spec.tune),
      100 * repeat.improvement.value_or(0), repeat.before.sd, repeat.after.sd);
  for (std::size_t i = 1; i < chosen.evaluations.size(); ++i) {
    const evaluation::BiasStability& other = chosen.evaluations[i].stability;
    text += fmt::format(" On {} it is {:.1f} %: {:.5f} → {:.5f} deg/h.", experiment.data.evaluated[i].name,
                        100 * other.improvement.value_or(0), other.before.sd, other.after.sd);
  }
  if (is_usual(chosen.spec))
    text += " Its method was fixed in advance, and it was tuned only on the training recording.";
  section.blocks = {Paragraph{text, Emphasis::kGood}, ladder_table(experiment)};
  for (std::size_t i = 0; i < experiment.data.evaluated.size(); ++i) {
    const std::vector<std::string> worse = worse_than_uncompensated(experiment, i);
    if (worse.empty()) continue;
    section.blocks.push_back(
        Paragraph{fmt::format("{} of {} models are worse than no compensation on {}: {}.", worse.size(),
                              experiment.rows.size(), experiment.data.evaluated[i].name, fmt::join(worse, "; ")),
                  Emphasis::kWarn});
  }
  return section;
}

Section stepwise_section(const Experiment& experiment) {
  Section section{"stepwise",
                  "Stepwise regression",
                  {stepwise_table(experiment), stepwise_terms_table(experiment), stepwise_figure(experiment)}};
  for (const ExperimentRow* row : rows_of(experiment, "stepwise", "")) {
    section.blocks.push_back(Paragraph{
        fmt::format("{}: {}.", method_text(row->spec), fmt::join(row->trained.trace, "; ")), Emphasis::kMuted});
  }
  return section;
}

Section tuning_section(const Experiment& experiment) {
  Section section{"tuning", "Effect of the tuning", {tuning_table(experiment)}};
  if (const auto figure = surface_figure(*chosen_row(experiment))) section.blocks.push_back(*figure);
  for (const ExperimentRow& row : experiment.rows) {
    for (const std::string& warning : row.trained.warnings) {
      section.blocks.push_back(Paragraph{row.spec.key() + ": " + warning, Emphasis::kMuted});
    }
  }
  return section;
}

/// Adds a section, unless its table is empty.
void add_kernel_section(std::vector<Section>& sections, Section section, report::Table table, report::Figure figure) {
  if (table.rows.empty()) return;
  section.blocks.push_back(std::move(table));
  if (!figure.plot.panels.empty()) section.blocks.push_back(std::move(figure));
  sections.push_back(std::move(section));
}

}  // namespace

std::string method_text(const ModelSpec& spec) {
  if (spec.method == "ls") return "LS, cubic";
  if (spec.method == "stepwise") return spec.inputs.size() == 3 ? "stepwise, model 2" : "stepwise, model 1";
  if (spec.method == "lssvm") return "LSSVM";
  return "IR-LSSVM, " + spec.weight;
}

std::string tune_text(const std::string& tune) {
  if (tune == "shuffled") return "ten-fold, shuffled";
  if (tune == "loo") return "leave-one-out";
  if (tune == "blocked") return "contiguous blocks";
  if (tune == "reml") return "likelihood (REML)";
  return report::kNothing;
}

std::optional<double> milli(std::optional<double> value) { return value ? std::optional(1e3 * *value) : std::nullopt; }

std::string basis_text(const Experiment& experiment) {
  return fmt::format("1 sigma of {} s means, divisor {}", experiment.data.training.features.length_s,
                     evaluation::divisor_text(experiment.divisor));
}

std::vector<const ExperimentRow*> rows_of(const Experiment& experiment, const std::string& method,
                                          const std::string& tune) {
  std::vector<const ExperimentRow*> rows;
  for (const ExperimentRow& row : experiment.rows) {
    if (row.spec.method == method && row.spec.tune == tune) rows.push_back(&row);
  }
  return rows;
}

const evaluation::BiasStability& on_repeat(const ExperimentRow& row) { return row.evaluations.front().stability; }

const ExperimentRow* best_of(const Experiment& experiment, const std::string& method, const std::string& tune) {
  const ExperimentRow* best = nullptr;
  for (const ExperimentRow* row : rows_of(experiment, method, tune)) {
    if (!best || on_repeat(*row).after.sd < on_repeat(*best).after.sd) best = row;
  }
  return best;
}

const ExperimentRow* chosen_row(const Experiment& experiment) {
  const ExperimentRow* best = nullptr;
  for (const ExperimentRow& row : experiment.rows) {
    if (is_usual(row.spec)) return &row;
    if (!best || relative_sum(row) < relative_sum(*best)) best = &row;
  }
  return best;
}

std::vector<Section> experiment_sections(const Experiment& experiment, const std::vector<Limit>& limits,
                                         bool& within_limits) {
  std::vector<Section> sections = {
      summary(experiment),
      {"correlation",
       "Inputs correlated with the bias",
       {correlation_table(experiment), inputs_figure(experiment.data.training)}},
      {"least_squares", "Least squares", {least_squares_table(experiment), least_squares_figure(experiment)}},
      stepwise_section(experiment)};
  add_kernel_section(sections, {"single", "IR-LSSVM with one input", {}}, single_input_table(experiment),
                     weights_by_inputs_figure(experiment, 1, 1));
  add_kernel_section(sections, {"composite", "IR-LSSVM with composite inputs", {}}, composite_table(experiment),
                     weights_by_inputs_figure(experiment, 2, 3));
  if (const auto figure = lssvm_figure(experiment)) sections.back().blocks.push_back(*figure);
  sections.push_back({"profiles", "Other profiles", {profiles_table(experiment)}});
  sections.push_back(tuning_section(experiment));
  const ExperimentRow& chosen = *chosen_row(experiment);
  for (std::size_t i = 0; i < experiment.data.evaluated.size(); ++i) {
    const EvaluatedRecording recording{fmt::format("r{}", i + 1), &experiment.data.evaluated[i], &chosen.evaluations[i],
                                       &experiment.data.training,
                                       i == 0 && !chosen.trained.weights.empty() ? &chosen.trained.weights : nullptr};
    Section section{recording.id, fmt::format("{} on {}", method_text(chosen.spec), recording.table->name), {}};
    if (!limits.empty()) {
      const auto checks = check_limits(limits, measure_all(recording));
      within_limits = within_limits &&
                      std::all_of(checks.begin(), checks.end(), [](const LimitCheck& check) { return check.pass; });
      section.blocks.push_back(limits_table(checks, recording.id, recording.table->name));
    }
    add_recording_blocks(recording, [&](report::Block block) { section.blocks.push_back(std::move(block)); });
    sections.push_back(std::move(section));
  }
  return sections;
}

}  // namespace prism::analysis
