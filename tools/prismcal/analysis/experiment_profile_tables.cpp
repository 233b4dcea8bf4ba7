// SPDX-License-Identifier: MIT
// The tables that the paper lacks: other profiles, and how the tuning decides.
#include <algorithm>

#include "tools/prismcal/analysis/experiment_report.hpp"

namespace prism::analysis {

using report::Cell;
using report::fixed_cell;
using report::general_cell;
using report::percent_cell;
using report::Table;
using report::text_cell;

Table ladder_table(const Experiment& experiment) {
  Table table{
      "ladder", "From LS to IR-LSSVM", {}, {{"method", "", false}, {"inputs", "", false}, {"tuned by", "", false}}, {}};
  table.caption =
      basis_text(experiment) +
      ". One model of each type, on every recording: LS on the input with the lowest bias stability on the "
      "repeat, kernels tuned by "
      "likelihood on the training recording. 95 % of further: the 95 % prediction interval of the improvement of "
      "further "
      "recordings of the profile; against the row above: the same interval of the difference, on the repeat.";
  for (const recordings::BlockTable& recording : experiment.data.evaluated) {
    table.columns.push_back({recording.name + ": before", "deg/h"});
    table.columns.push_back({"after", "deg/h"});
    table.columns.push_back({"improvement", "%"});
    table.columns.push_back({"95 % of further", "%"});
  }
  table.columns.push_back({"against the row above", "points"});
  const ExperimentRow* above = nullptr;
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
    for (const ModelEvaluation& judged : row->judged) {
      const evaluation::BiasStability& s = judged.stability;
      const bool worse = s.improvement && *s.improvement < 0;
      cells.push_back(fixed_cell(s.before.sd, 5));
      cells.push_back(fixed_cell(s.after.sd, 5));
      cells.push_back(percent_cell(s.improvement, worse ? report::Emphasis::kBad : report::Emphasis::kNone));
      cells.push_back(text_cell(interval_text(judged.next)));
    }
    cells.push_back(above ? difference_cell(above->judged[0], row->judged[0], experiment.data.evaluated[0])
                          : text_cell(report::kNothing));
    above = row;
    table.rows.push_back(std::move(cells));
  }
  return table;
}

Table profiles_table(const Experiment& experiment) {
  Table table{"profiles",
              "Every model on every recording",
              {},
              {{"method", "", false}, {"inputs", "", false}, {"tuned by", "", false}},
              {}};
  table.caption =
      basis_text(experiment) +
      ". \"off\" is the share of blocks outside the model's training range. Red: worse than no compensation.";
  for (const recordings::BlockTable& recording : experiment.data.evaluated) {
    table.columns.push_back({recording.name + ": after", "deg/h"});
    table.columns.push_back({"improvement", "%"});
    table.columns.push_back({"off", "%"});
  }
  for (const ExperimentRow& row : experiment.rows) {
    std::vector<Cell> cells = {text_cell(method_text(row.spec)), text_cell(row.spec.inputs_text()),
                               text_cell(tune_text(row.spec.tune))};
    for (const ModelEvaluation& judged : row.judged) {
      const evaluation::BiasStability& s = judged.stability;
      const bool worse = s.improvement && *s.improvement < 0;
      cells.push_back(fixed_cell(s.after.sd, 5));
      cells.push_back(percent_cell(s.improvement, worse ? report::Emphasis::kBad : report::Emphasis::kNone));
      cells.push_back(fixed_cell(judged.extrapolated_percent(), 1));
    }
    table.rows.push_back(std::move(cells));
  }
  return table;
}

Table tuning_table(const Experiment& experiment) {
  Table table{"tuning",
              "How the tuning decides what a model learns",
              {},
              {{"method", "", false}, {"tuned by", "", false}, {"c"}, {"sigma2"}, {"F(x)", "1e-3 deg/h"}},
              {}};
  table.caption = basis_text(experiment) +
                  ", all inputs. Shuffled folds and leave-one-out leave a sample's neighbours in the training data: on "
                  "a time series they "
                  "prefer narrow kernels that remember the profile. Contiguous blocks and the likelihood ask for what "
                  "carries over.";
  for (const recordings::BlockTable& recording : experiment.data.evaluated)
    table.columns.push_back({recording.name + ": improvement", "%"});
  std::size_t most = 0;
  for (const ExperimentRow& row : experiment.rows) most = std::max(most, row.spec.inputs.size());
  for (const char* method : {"lssvm", "ir-lssvm"}) {
    for (const char* tune : {"shuffled", "loo", "blocked", "reml"}) {
      for (const ExperimentRow* row : rows_of(experiment, method, tune)) {
        if (row->spec.inputs.size() != most) continue;
        std::vector<Cell> cells = {text_cell(method_text(row->spec)), text_cell(tune_text(tune)),
                                   general_cell(row->trained.c, 4), general_cell(row->trained.sigma2, 4),
                                   fixed_cell(milli(row->trained.cost_deg_per_h), 4)};
        for (const ModelEvaluation& judged : row->judged) {
          const auto& gain = judged.stability.improvement;
          cells.push_back(percent_cell(gain, gain && *gain < 0 ? report::Emphasis::kBad : report::Emphasis::kNone));
        }
        table.rows.push_back(std::move(cells));
      }
    }
  }
  return table;
}

}  // namespace prism::analysis
