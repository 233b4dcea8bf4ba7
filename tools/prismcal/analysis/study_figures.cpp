// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/study_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/prismcal/analysis/study_words.hpp"

namespace prism::analysis {
namespace {

using report::Figure;
using report::Form;
using report::Ink;
using report::Panel;
using report::Series;

constexpr report::Ink kInks[] = {report::Ink::kModel, report::Ink::kAccent1, report::Ink::kAccent2,
                                 report::Ink::kAccent3};

std::string lettered(std::size_t index, const std::string& title) {
  return fmt::format("({}) {}", static_cast<char>('a' + index), title);
}

report::Panel bias_panel(std::string title, const recordings::BlockTable& table, const char* name) {
  return {std::move(title),
          {"time, h"},
          {"bias, deg/h"},
          {},
          {{name, report::Ink::kRaw, report::Form::kLine, table.hours(), table.bias_deg_per_h}}};
}

/// Two panels: the training recording with the models' fits, the repeat with what they leave.
void add_pair(report::Plot& plot, const Study& study, const std::vector<const StudyRow*>& rows, const std::string& what,
              std::string (*name)(const ModelSpec&)) {
  const recordings::BlockTable& repeat = study.data.evaluated.front();
  report::Panel fit = bias_panel(lettered(plot.panels.size(), what + ", regression"), study.data.training, "bias");
  report::Panel left = bias_panel(lettered(plot.panels.size() + 1, what + ", compensation"), repeat, "before");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const report::Ink ink = kInks[i % std::size(kInks)];
    fit.series.push_back({name(rows[i]->spec), ink, report::Form::kLine, study.data.training.hours(),
                          rows[i]->fitted.predicted_deg_per_h});
    left.series.push_back(
        {name(rows[i]->spec), ink, report::Form::kLine, repeat.hours(), rows[i]->judged.front().corrected_deg_per_h});
  }
  plot.panels.push_back(std::move(fit));
  plot.panels.push_back(std::move(left));
}

std::string inputs_name(const ModelSpec& spec) { return spec.inputs_text(); }
std::string weight_name_of(const ModelSpec& spec) { return spec.weight; }

report::Panel twin_panel(const recordings::BlockTable& table, std::size_t index, const char* title, const char* label,
                         const char* input) {
  report::Panel panel = bias_panel(lettered(index, title), table, "bias");
  panel.right.label = label;
  panel.series.push_back(
      {title, report::Ink::kModel, report::Form::kLine, table.hours(), table.column(input), {}, true});
  return panel;
}

}  // namespace

report::Figure inputs_figure(const recordings::BlockTable& table) {
  report::Figure figure{
      "fig_inputs",
      "The gyro's output and what moves with it",
      fmt::format("{} s means of the training recording. After figure 6 of the paper.", table.features.length_s),
      {}};
  figure.plot.panel_height = 200;
  figure.plot.panels = {twin_panel(table, 0, "temperature", "T, °C", compensation::kInputTemperature),
                        twin_panel(table, 1, "slope of temperature", "dT/dt, °C/s", compensation::kInputSlope)};
  if (std::isfinite(table.column(compensation::kInputUhfo).front())) {
    figure.plot.panels.push_back(twin_panel(table, 2, "UHFO", "U, V", compensation::kInputUhfo));
  }
  return figure;
}

report::Figure least_squares_figure(const Study& study) {
  report::Figure figure{"fig_least_squares",
                        "LS models",
                        basis_text(study) + " in the tables; here the means. After figure 7 of the paper.",
                        {2, 300, {}}};
  add_pair(figure.plot, study, rows_of(study, "ls", ""), "LS", inputs_name);
  return figure;
}

report::Figure stepwise_figure(const Study& study) {
  const recordings::BlockTable& repeat = study.data.evaluated.front();
  report::Figure figure{
      "fig_stepwise", "Stepwise regression", "Means of the repeated cycle. After figure 8 of the paper.", {2, 300, {}}};
  for (const StudyRow* row : rows_of(study, "stepwise", "")) {
    report::Panel panel = bias_panel(lettered(figure.plot.panels.size(), method_text(row->spec)), repeat, "before");
    panel.series.push_back({"after", report::Ink::kCorrected, report::Form::kLine, repeat.hours(),
                            row->judged.front().corrected_deg_per_h});
    figure.plot.panels.push_back(std::move(panel));
  }
  return figure;
}

report::Figure weights_by_inputs_figure(const Study& study, std::size_t from, std::size_t to) {
  report::Figure figure{
      fmt::format("fig_ir_lssvm_{}", from),
      from == 1 ? "IR-LSSVM, one input" : "IR-LSSVM, composite inputs",
      fmt::format("Left the training cycle and the fits, right its repeat. After figure {} of the paper.",
                  from == 1 ? 9 : 10),
      {2, 290, {}}};
  std::vector<const StudyRow*> rows = rows_of(study, "ir-lssvm", "shuffled");
  while (!rows.empty()) {
    const auto inputs = rows.front()->spec.inputs;
    std::vector<const StudyRow*> same;
    std::copy_if(rows.begin(), rows.end(), std::back_inserter(same),
                 [&](const StudyRow* row) { return row->spec.inputs == inputs; });
    std::erase_if(rows, [&](const StudyRow* row) { return row->spec.inputs == inputs; });
    if (inputs.size() >= from && inputs.size() <= to)
      add_pair(figure.plot, study, same, same.front()->spec.inputs_text(), weight_name_of);
  }
  return figure;
}

std::optional<report::Figure> lssvm_figure(const Study& study) {
  const StudyRow *plain = best_of(study, "lssvm", "loo"), *robust = best_of(study, "ir-lssvm", "shuffled");
  if (!plain || !robust) return std::nullopt;
  report::Figure figure{"fig_lssvm",
                        "LSSVM and IR-LSSVM",
                        fmt::format("Inputs {}. After figure 11 of the paper.", robust->spec.inputs_text()),
                        {2, 300, {}}};
  add_pair(figure.plot, study, {plain, robust}, "all inputs", method_text);
  return figure;
}

std::optional<report::Figure> surface_figure(const StudyRow& row) {
  const Trained& t = row.trained;
  if (t.surface.empty() || !t.c || !t.sigma2) return std::nullopt;
  report::Series heat{"", report::Ink::kRaw, report::Form::kHeat},
      chosen{"chosen", report::Ink::kModel, report::Form::kMark, {*t.c}, {*t.sigma2}};
  double lowest = t.surface.front().cost_deg_per_h;
  for (const SurfacePoint& point : t.surface) lowest = std::min(lowest, point.cost_deg_per_h);
  for (const SurfacePoint& point : t.surface) {
    heat.x.push_back(point.c);
    heat.y.push_back(point.sigma2);
    heat.high.push_back(std::min(2.0, point.cost_deg_per_h / lowest));  // beyond twice the best nobody looks
  }
  return report::Figure{
      "fig_surface",
      "The cost of the tuning over c and sigma2: " + method_text(row.spec),
      fmt::format("Survey grid of {} points, {}; cost over the lowest, cut at 2. A flat valley means that c "
                  "and sigma2 say little by themselves.",
                  t.surface.size(), tune_text(row.spec.tune)),
      {1, 380, {{"", {"c", true}, {"sigma2", true}, {}, {heat, chosen}}}}};
}

}  // namespace prism::analysis
