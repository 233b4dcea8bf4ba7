// SPDX-License-Identifier: MIT
// The tables that the paper lacks: other profiles, and how the tuning decides.
#include <algorithm>

#include "tools/prismcal/analysis/experiment_meanings.hpp"
#include "tools/prismcal/analysis/experiment_report.hpp"

namespace prism::analysis {

using report::Cell, report::fixed_cell, report::general_cell, report::percent_cell, report::Table, report::text_cell;

Table ladder_table(const Experiment& experiment) {
  Table table{
      "ladder", "From LS to IR-LSSVM", {}, {{"method", "", false}, {"inputs", "", false}, {"tuned by", "", false}}, {}};
  table.caption =
      basis_text(experiment) +
      ". One model of each type on every recording. LS uses the input with the lowest 1 sigma on the repeat run. "
      "Kernels are tuned by likelihood on the training recording. 95 % of further: 95 % prediction interval of the "
      "improvement "
      "in another recording of the same profile. Against the row above: the same interval for the difference, on the "
      "repeat run.";
  for (const recordings::BlockTable& recording : experiment.data.evaluated) {
    table.columns.push_back({recording.name + ": before", "deg/h"});
    table.columns.push_back({"after", "deg/h"});
    table.columns.push_back({"improvement", "%"});
    table.columns.push_back({"95 % of further", "%"});
  }
  table.columns.push_back({"against the row above", "points"});
  const ExperimentRow* above = nullptr;
  std::vector<const ExperimentRow*> shown;
  std::vector<const ExperimentRow*> rows = {best_of(experiment, "ls", "")};
  for (const ExperimentRow* row : rows_of(experiment, "stepwise", "")) rows.push_back(row);
  rows.push_back(best_of(experiment, "lssvm", kUsualTune));
  for (const ExperimentRow* row : rows_of(experiment, "ir-lssvm", kUsualTune)) {
    if (row->spec.weight == kUsualWeight) rows.push_back(row);
  }
  for (const ExperimentRow* row : rows) {
    if (!row) continue;
    std::vector<Cell> cells = {text_cell(method_text(row->spec)), text_cell(row->spec.inputs_text()),
                               text_cell(tune_text(row->spec.tune))};
    for (const ModelEvaluation& evaluated : row->evaluations) {
      const evaluation::BiasStability& s = evaluated.stability;
      const bool worse = s.improvement && *s.improvement < 0;
      cells.push_back(fixed_cell(s.before.sd, 5));
      cells.push_back(fixed_cell(s.after.sd, 5));
      cells.push_back(percent_cell(s.improvement, worse ? report::Emphasis::kBad : report::Emphasis::kNone));
      cells.push_back(text_cell(interval_text(evaluated.improvement_interval)));
    }
    cells.push_back(above ? difference_cell(above->evaluations[0], row->evaluations[0], experiment.data.evaluated[0])
                          : text_cell(report::kNothing));
    above = row;
    shown.push_back(row);
    table.rows.push_back(std::move(cells));
  }
  table.meaning = best_meaning(shown);
  return table;
}

Table profiles_table(const Experiment& experiment) {
  Table table{"profiles",
              "Every model on every recording",
              {},
              {{"method", "", false}, {"inputs", "", false}, {"tuned by", "", false}},
              {}};
  table.caption =
      basis_text(experiment) + ". Off: blocks outside the model's training range. Red: worse than no compensation.";
  for (const recordings::BlockTable& recording : experiment.data.evaluated) {
    table.columns.push_back({recording.name + ": after", "deg/h"});
    table.columns.push_back({"improvement", "%"});
    table.columns.push_back({"off", "%"});
  }
  std::vector<const ExperimentRow*> shown;
  for (const ExperimentRow& row : experiment.rows) {
    std::vector<Cell> cells = {text_cell(method_text(row.spec)), text_cell(row.spec.inputs_text()),
                               text_cell(tune_text(row.spec.tune))};
    for (const ModelEvaluation& evaluated : row.evaluations) {
      const evaluation::BiasStability& s = evaluated.stability;
      const bool worse = s.improvement && *s.improvement < 0;
      cells.push_back(fixed_cell(s.after.sd, 5));
      cells.push_back(percent_cell(s.improvement, worse ? report::Emphasis::kBad : report::Emphasis::kNone));
      cells.push_back(fixed_cell(evaluated.extrapolated_percent(), 1));
    }
    shown.push_back(&row);
    table.rows.push_back(std::move(cells));
  }
  table.meaning = profiles_meaning(shown);
  return table;
}

Table tuning_table(const Experiment& experiment) {
  Table table{"tuning",
              "Effect of the tuning",
              {},
              {{"method", "", false}, {"tuned by", "", false}, {"c"}, {"sigma2"}, {"F(x)", "1e-3 deg/h"}},
              {}};
  table.caption =
      basis_text(experiment) +
      ", all inputs. Shuffled folds and leave-one-out keep a sample's neighbours in the training data, so on a "
      "time series they prefer narrow kernels that fit the noise of the profile. Contiguous blocks and the "
      "likelihood prefer repeatable effects.";
  for (const recordings::BlockTable& recording : experiment.data.evaluated)
    table.columns.push_back({recording.name + ": improvement", "%"});
  std::vector<const ExperimentRow*> shown;
  std::size_t most = 0;
  for (const ExperimentRow& row : experiment.rows) most = std::max(most, row.spec.inputs.size());
  for (const char* method : {"lssvm", "ir-lssvm"}) {
    for (const char* tune : {"shuffled", "loo", "blocked", "reml"}) {
      for (const ExperimentRow* row : rows_of(experiment, method, tune)) {
        if (row->spec.inputs.size() != most) continue;
        std::vector<Cell> cells = {text_cell(method_text(row->spec)), text_cell(tune_text(tune)),
                                   general_cell(row->trained.c, 4), general_cell(row->trained.sigma2, 4),
                                   fixed_cell(milli(row->trained.cost_deg_per_h), 4)};
        for (const ModelEvaluation& evaluated : row->evaluations) {
          const auto& gain = evaluated.stability.improvement;
          cells.push_back(percent_cell(gain, gain && *gain < 0 ? report::Emphasis::kBad : report::Emphasis::kNone));
        }
        shown.push_back(row);
        table.rows.push_back(std::move(cells));
      }
    }
  }
  table.meaning = tuning_meaning(shown);
  return table;
}

}  // namespace prism::analysis
