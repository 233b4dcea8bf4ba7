// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "compensation/evaluation/correlation.hpp"
#include "tools/prismcal/analysis/experiment_meanings.hpp"
#include "tools/prismcal/analysis/experiment_report.hpp"
#include "tools/prismcal/analysis/paper_numbers.hpp"

namespace prism::analysis {
namespace {

using report::Cell, report::fixed_cell, report::general_cell, report::percent_cell, report::Table, report::text_cell;

/// Appends before, after, improvement and its interval, then the paper's after and improvement.
void append_effect(std::vector<Cell>& cells, const ExperimentRow& row,
                   report::Emphasis emphasis = report::Emphasis::kNone) {
  const evaluation::BiasStability& s = on_repeat(row);
  const auto paper = paper_row(row.spec);
  cells.push_back(fixed_cell(s.before.sd, 5));
  cells.push_back(fixed_cell(s.after.sd, 5, emphasis));
  cells.push_back(percent_cell(s.improvement, s.improvement && *s.improvement < 0 ? report::Emphasis::kBad : emphasis));
  cells.push_back(text_cell(interval_text(row.evaluations.front().improvement_interval)));
  cells.push_back(
      fixed_cell(paper ? std::optional(paper->after_deg_per_h) : std::nullopt, 5, report::Emphasis::kMuted));
  cells.push_back(percent_cell(paper ? std::optional(paper->improvement) : std::nullopt, report::Emphasis::kMuted));
}

std::vector<report::Column> effect_columns(std::vector<report::Column> first) {
  for (report::Column column : {report::Column{"before", "deg/h"}, report::Column{"after", "deg/h"},
                                report::Column{"improvement", "%"}, report::Column{"95 % of further", "%"},
                                report::Column{"paper: after", "deg/h"}, report::Column{"paper: improvement", "%"}}) {
    first.push_back(std::move(column));
  }
  return first;
}

Table kernel_table(const Experiment& experiment, std::string id, std::string title, std::size_t from, std::size_t to) {
  Table table{std::move(id), std::move(title), {}, {}, {}};
  table.caption = basis_text(experiment) +
                  ", trained on one cycle and tested on its repeat. c and sigma2 are for normalised data; F(x) is the "
                  "mean absolute error on held-out folds. The paper's results are for another gyro.";
  table.columns =
      effect_columns({{"inputs", "", false}, {"weights", "", false}, {"c"}, {"sigma2"}, {"F(x)", "1e-3 deg/h"}});
  std::vector<const ExperimentRow*> rows = rows_of(experiment, "ir-lssvm", "shuffled");
  for (const ExperimentRow* row : rows_of(experiment, "lssvm", "loo")) rows.push_back(row);
  std::erase_if(
      rows, [=](const ExperimentRow* row) { return row->spec.inputs.size() < from || row->spec.inputs.size() > to; });
  const ExperimentRow* best = nullptr;
  for (const ExperimentRow* row : rows) {
    if (!best || on_repeat(*row).after.sd < on_repeat(*best).after.sd) best = row;
  }
  for (const ExperimentRow* row : rows) {
    const Trained& t = row->trained;
    std::vector<Cell> cells = {text_cell(row->spec.inputs_text()),
                               text_cell(row->spec.weight.empty() ? "unweighted" : row->spec.weight),
                               general_cell(t.c, 5), general_cell(t.sigma2, 4), fixed_cell(milli(t.cost_deg_per_h), 4)};
    append_effect(cells, *row, row == best ? report::Emphasis::kBest : report::Emphasis::kNone);
    table.rows.push_back(std::move(cells));
  }
  table.meaning = best_meaning(rows);
  return table;
}

}  // namespace

Table correlation_table(const Experiment& experiment) {
  Table table{"correlation", "Correlation with the bias", {}, {{"", "", false}}, {}};
  table.caption = fmt::format(
      "Pearson's coefficient over {} blocks of {} s, training recording. The paper's results are for another gyro.",
      experiment.data.training.size(), experiment.data.training.features.length_s);
  std::vector<Cell> ours = {text_cell("this gyro")}, theirs = {text_cell("the paper's", report::Emphasis::kMuted)};
  const char* const inputs[] = {compensation::kInputTemperature, compensation::kInputSlope, compensation::kInputUhfo};
  const char* const names[] = {"temperature", "slope of temperature", "UHFO"};
  std::vector<double> found;
  for (std::size_t i = 0; i < 3; ++i) {
    table.columns.push_back({names[i]});
    const auto r = evaluation::correlate(experiment.data.training.column(inputs[i]),
                                         experiment.data.training.bias_deg_per_h, names[i]);
    found.push_back(r ? *r : kUnknown);
    ours.push_back(fixed_cell(r ? std::optional(*r) : std::nullopt, 2));
    theirs.push_back(fixed_cell(kPaperCorrelation[i], 2, report::Emphasis::kMuted));
  }
  table.rows = {ours, theirs};
  table.meaning = correlation_meaning({std::begin(names), std::end(names)}, found);
  return table;
}

Table least_squares_table(const Experiment& experiment) {
  Table table{"least_squares", "LS model (eq. 21), one input", {}, effect_columns({{"input", "", false}}), {}};
  table.caption = basis_text(experiment) + ", trained on one cycle and tested on its repeat.";
  for (const ExperimentRow* row : rows_of(experiment, "ls", "")) {
    std::vector<Cell> cells = {text_cell(row->spec.inputs_text())};
    append_effect(cells, *row);
    table.rows.push_back(std::move(cells));
  }
  table.meaning = best_meaning(rows_of(experiment, "ls", ""));
  return table;
}

Table stepwise_table(const Experiment& experiment) {
  Table table{"stepwise",
              "Stepwise regression (eqs. 22 to 25)",
              {},
              effect_columns({{"model", "", false}, {"inputs", "", false}}),
              {}};
  table.caption = basis_text(experiment) +
                  ", trained on one cycle and tested on its repeat. Terms enter at p < 0.05 and leave at p > 0.10.";
  for (const ExperimentRow* row : rows_of(experiment, "stepwise", "")) {
    std::vector<Cell> cells = {text_cell(row->spec.inputs.size() == 3 ? "model 2" : "model 1"),
                               text_cell(row->spec.inputs_text())};
    append_effect(cells, *row);
    table.rows.push_back(std::move(cells));
  }
  table.meaning = best_meaning(rows_of(experiment, "stepwise", ""));
  return table;
}

Table stepwise_terms_table(const Experiment& experiment) {
  Table table{"stepwise_terms",
              "Terms that stepwise regression kept",
              "Coefficients in deg/h over the units of the term: T in degC, dT/dt in degC/s, U in V.",
              {{"model", "", false}, {"term", "", false}, {"coefficient"}},
              {}};
  for (const ExperimentRow* row : rows_of(experiment, "stepwise", "")) {
    for (const auto& [term, coefficient] : row->trained.terms) {
      table.rows.push_back({text_cell(row->spec.inputs.size() == 3 ? "model 2" : "model 1"), text_cell(term),
                            general_cell(coefficient, 6)});
    }
  }
  table.meaning = terms_meaning(rows_of(experiment, "stepwise", ""));
  return table;
}

Table single_input_table(const Experiment& experiment) {
  return kernel_table(experiment, "ir_lssvm_single", "IR-LSSVM, one input", 1, 1);
}

Table composite_table(const Experiment& experiment) {
  return kernel_table(experiment, "ir_lssvm_composite", "IR-LSSVM, composite inputs", 2, 3);
}

}  // namespace prism::analysis
