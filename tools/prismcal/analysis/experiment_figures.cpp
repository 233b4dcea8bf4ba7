// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/prismcal/analysis/experiment_meanings.hpp"
#include "tools/prismcal/analysis/experiment_report.hpp"
#include "tools/prismcal/analysis/recording_meanings.hpp"

namespace prism::analysis {
namespace {

using report::Figure;
using report::Ink;
using report::Panel;
using report::Series;
using report::SeriesStyle;

constexpr Ink kInks[] = {Ink::kModel, Ink::kAccent1, Ink::kAccent2, Ink::kAccent3};

std::string lettered(std::size_t index, const std::string& title) {
  return fmt::format("({}) {}", static_cast<char>('a' + index), title);
}

Panel bias_panel(std::string title, const recordings::BlockTable& table, const char* name) {
  return {std::move(title),
          {"time, h"},
          {"bias, deg/h"},
          {},
          {{name, Ink::kRaw, SeriesStyle::kLine, table.hours(), table.bias_deg_per_h}}};
}

/// Adds two panels: the training recording with the fits, and the repeat run with the residuals.
void add_pair(report::Plot& plot, const Experiment& experiment, const std::vector<const ExperimentRow*>& rows,
              const std::string& what, std::string (*name)(const ModelSpec&)) {
  const recordings::BlockTable& repeat = experiment.data.evaluated.front();
  Panel fit = bias_panel(lettered(plot.panels.size(), what + ", regression"), experiment.data.training, "bias");
  Panel left = bias_panel(lettered(plot.panels.size() + 1, what + ", compensation"), repeat, "before");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Ink ink = kInks[i % std::size(kInks)];
    fit.series.push_back({name(rows[i]->spec), ink, SeriesStyle::kLine, experiment.data.training.hours(),
                          rows[i]->fitted.predicted_deg_per_h});
    left.series.push_back({name(rows[i]->spec), ink, SeriesStyle::kLine, repeat.hours(),
                           rows[i]->evaluations.front().corrected_deg_per_h});
  }
  plot.panels.push_back(std::move(fit));
  plot.panels.push_back(std::move(left));
}

std::string inputs_name(const ModelSpec& spec) { return spec.inputs_text(); }
std::string weight_name_of(const ModelSpec& spec) { return spec.weight; }

Panel twin_panel(const recordings::BlockTable& table, std::size_t index, const char* title, const char* label,
                 const char* input) {
  Panel panel = bias_panel(lettered(index, title), table, "bias");
  panel.right.label = label;
  panel.series.push_back({title, Ink::kModel, SeriesStyle::kLine, table.hours(), table.column(input), {}, true});
  return panel;
}

}  // namespace

Figure inputs_figure(const recordings::BlockTable& table) {
  Figure figure{"fig_inputs",
                "Bias and the inputs correlated with it",
                fmt::format("{} s means of the training recording. As figure 6 of the paper.", table.features.length_s),
                {}};
  figure.plot.panel_height = 200;
  figure.plot.panels = {twin_panel(table, 0, "temperature", "T, °C", compensation::kInputTemperature),
                        twin_panel(table, 1, "slope of temperature", "dT/dt, °C/s", compensation::kInputSlope)};
  if (std::isfinite(table.column(compensation::kInputUhfo).front())) {
    figure.plot.panels.push_back(twin_panel(table, 2, "UHFO", "U, V", compensation::kInputUhfo));
  }
  figure.meaning = record_meaning(table);
  return figure;
}

Figure least_squares_figure(const Experiment& experiment) {
  Figure figure{"fig_least_squares",
                "LS models",
                fmt::format("{} s means. As figure 7 of the paper.", experiment.data.training.features.length_s),
                {2, 300, {}}};
  add_pair(figure.plot, experiment, rows_of(experiment, "ls", ""), "LS", inputs_name);
  figure.meaning = fit_meaning(rows_of(experiment, "ls", ""));
  return figure;
}

Figure stepwise_figure(const Experiment& experiment) {
  const recordings::BlockTable& repeat = experiment.data.evaluated.front();
  Figure figure{
      "fig_stepwise", "Stepwise regression", "Means of the repeated cycle. As figure 8 of the paper.", {2, 300, {}}};
  for (const ExperimentRow* row : rows_of(experiment, "stepwise", "")) {
    Panel panel = bias_panel(lettered(figure.plot.panels.size(), method_text(row->spec)), repeat, "before");
    panel.series.push_back(
        {"after", Ink::kCorrected, SeriesStyle::kLine, repeat.hours(), row->evaluations.front().corrected_deg_per_h});
    figure.plot.panels.push_back(std::move(panel));
  }
  figure.meaning = fit_meaning(rows_of(experiment, "stepwise", ""));
  return figure;
}

Figure weights_by_inputs_figure(const Experiment& experiment, std::size_t from, std::size_t to) {
  Figure figure{
      fmt::format("fig_ir_lssvm_{}", from),
      from == 1 ? "IR-LSSVM, one input" : "IR-LSSVM, composite inputs",
      fmt::format("Left: training cycle and fits; right: its repeat. As figure {} of the paper.", from == 1 ? 9 : 10),
      {2, 290, {}}};
  std::vector<const ExperimentRow*> rows = rows_of(experiment, "ir-lssvm", "shuffled"), drawn;
  while (!rows.empty()) {
    const auto inputs = rows.front()->spec.inputs;
    std::vector<const ExperimentRow*> same;
    std::copy_if(rows.begin(), rows.end(), std::back_inserter(same),
                 [&](const ExperimentRow* row) { return row->spec.inputs == inputs; });
    std::erase_if(rows, [&](const ExperimentRow* row) { return row->spec.inputs == inputs; });
    if (inputs.size() < from || inputs.size() > to) continue;
    add_pair(figure.plot, experiment, same, same.front()->spec.inputs_text(), weight_name_of);
    drawn.insert(drawn.end(), same.begin(), same.end());
  }
  figure.meaning = fit_meaning(drawn);
  return figure;
}

std::optional<Figure> lssvm_figure(const Experiment& experiment) {
  const ExperimentRow *plain = best_of(experiment, "lssvm", "loo"),
                      *robust = best_of(experiment, "ir-lssvm", "shuffled");
  if (!plain || !robust) return std::nullopt;
  Figure figure{"fig_lssvm",
                "LSSVM and IR-LSSVM",
                fmt::format("Inputs {}. As figure 11 of the paper.", robust->spec.inputs_text()),
                {2, 300, {}}};
  add_pair(figure.plot, experiment, {plain, robust}, "all inputs", method_text);
  figure.meaning = best_meaning({plain, robust});
  return figure;
}

std::optional<Figure> surface_figure(const ExperimentRow& row) {
  const Trained& t = row.trained;
  if (t.surface.empty() || !t.c || !t.sigma2) return std::nullopt;
  Series heat{"", Ink::kRaw, SeriesStyle::kHeat},
      chosen{"chosen", Ink::kModel, SeriesStyle::kMark, {*t.c}, {*t.sigma2}};
  double lowest = t.surface.front().cost_deg_per_h;
  for (const SurfacePoint& point : t.surface) lowest = std::min(lowest, point.cost_deg_per_h);
  for (const SurfacePoint& point : t.surface) {
    heat.x.push_back(point.c);
    heat.y.push_back(point.sigma2);
    heat.high.push_back(std::min(2.0, point.cost_deg_per_h / lowest));  // clipped at twice the best
  }
  return Figure{
      "fig_surface",
      "The cost of the tuning over c and sigma2: " + method_text(row.spec),
      fmt::format("Grid search over {} points, {}; cost relative to the lowest, clipped at 2. In a flat valley, "
                  "only a combination of c and sigma2 is determined.",
                  t.surface.size(), tune_text(row.spec.tune)),
      {1, 380, {{"", {"c", true}, {"sigma2", true}, {}, {heat, chosen}}}},
      surface_meaning(t.surface)};
}

}  // namespace prism::analysis
