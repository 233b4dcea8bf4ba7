// SPDX-License-Identifier: MIT
#include "tools/prismcal/evaluation/study_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/prismcal/evaluation/study_words.hpp"

namespace prism {
namespace {

using report::Figure;
using report::Form;
using report::Ink;
using report::Panel;
using report::Series;

constexpr Ink kInks[] = {Ink::kModel, Ink::kAccent1, Ink::kAccent2, Ink::kAccent3};

std::string lettered(std::size_t index, const std::string& title) {
  return fmt::format("({}) {}", static_cast<char>('a' + index), title);
}

Panel bias_panel(std::string title, const BlockTable& table, const char* name) {
  return {std::move(title),
          {"time, h"},
          {"bias, deg/h"},
          {},
          {{name, Ink::kRaw, Form::kLine, table.hours(), table.bias_deg_per_h}}};
}

/// Two panels: the training recording with the models' fits, the repeat with what they leave.
void add_pair(report::Plot& plot, const Study& study, const std::vector<const StudyRow*>& rows, const std::string& what,
              std::string (*name)(const ModelSpec&)) {
  const BlockTable& repeat = study.data.evaluated.front();
  Panel fit = bias_panel(lettered(plot.panels.size(), what + ", regression"), study.data.training, "bias");
  Panel left = bias_panel(lettered(plot.panels.size() + 1, what + ", compensation"), repeat, "before");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Ink ink = kInks[i % std::size(kInks)];
    fit.series.push_back(
        {name(rows[i]->spec), ink, Form::kLine, study.data.training.hours(), rows[i]->fitted.predicted_deg_per_h});
    left.series.push_back(
        {name(rows[i]->spec), ink, Form::kLine, repeat.hours(), rows[i]->judged.front().corrected_deg_per_h});
  }
  plot.panels.push_back(std::move(fit));
  plot.panels.push_back(std::move(left));
}

std::string inputs_name(const ModelSpec& spec) { return spec.inputs_text(); }
std::string weight_name_of(const ModelSpec& spec) { return spec.weight; }

Panel twin_panel(const BlockTable& table, std::size_t index, const char* title, const char* label, const char* input) {
  Panel panel = bias_panel(lettered(index, title), table, "bias");
  panel.right.label = label;
  panel.series.push_back({title, Ink::kModel, Form::kLine, table.hours(), table.column(input), {}, true});
  return panel;
}

}  // namespace

Figure inputs_figure(const BlockTable& table) {
  Figure figure{
      "fig_inputs",
      "The gyro's output and what moves with it",
      fmt::format("{} s means of the training recording. After figure 6 of the paper.", table.features.length_s),
      {}};
  figure.plot.panel_height = 200;
  figure.plot.panels = {twin_panel(table, 0, "temperature", "T, °C", kInputTemperature),
                        twin_panel(table, 1, "slope of temperature", "dT/dt, °C/s", kInputSlope)};
  if (std::isfinite(table.column(kInputUhfo).front())) {
    figure.plot.panels.push_back(twin_panel(table, 2, "UHFO", "U, V", kInputUhfo));
  }
  return figure;
}

Figure least_squares_figure(const Study& study) {
  Figure figure{"fig_least_squares",
                "LS models",
                basis_text(study) + " in the tables; here the means. After figure 7 of the paper.",
                {2, 300, {}}};
  add_pair(figure.plot, study, rows_of(study, "ls", ""), "LS", inputs_name);
  return figure;
}

Figure stepwise_figure(const Study& study) {
  const BlockTable& repeat = study.data.evaluated.front();
  Figure figure{
      "fig_stepwise", "Stepwise regression", "Means of the repeated cycle. After figure 8 of the paper.", {2, 300, {}}};
  for (const StudyRow* row : rows_of(study, "stepwise", "")) {
    Panel panel = bias_panel(lettered(figure.plot.panels.size(), method_text(row->spec)), repeat, "before");
    panel.series.push_back(
        {"after", Ink::kCorrected, Form::kLine, repeat.hours(), row->judged.front().corrected_deg_per_h});
    figure.plot.panels.push_back(std::move(panel));
  }
  return figure;
}

Figure weights_by_inputs_figure(const Study& study, std::size_t from, std::size_t to) {
  Figure figure{fmt::format("fig_ir_lssvm_{}", from),
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

std::optional<Figure> lssvm_figure(const Study& study) {
  const StudyRow *plain = best_of(study, "lssvm", "loo"), *robust = best_of(study, "ir-lssvm", "shuffled");
  if (!plain || !robust) return std::nullopt;
  Figure figure{"fig_lssvm",
                "LSSVM and IR-LSSVM",
                fmt::format("Inputs {}. After figure 11 of the paper.", robust->spec.inputs_text()),
                {2, 300, {}}};
  add_pair(figure.plot, study, {plain, robust}, "all inputs", method_text);
  return figure;
}

std::optional<Figure> surface_figure(const StudyRow& row) {
  const Trained& t = row.trained;
  if (t.surface.empty() || !t.c || !t.sigma2) return std::nullopt;
  Series heat{"", Ink::kRaw, Form::kHeat}, chosen{"chosen", Ink::kModel, Form::kMark, {*t.c}, {*t.sigma2}};
  double lowest = t.surface.front().cost_deg_per_h;
  for (const SurfacePoint& point : t.surface) lowest = std::min(lowest, point.cost_deg_per_h);
  for (const SurfacePoint& point : t.surface) {
    heat.x.push_back(point.c);
    heat.y.push_back(point.sigma2);
    heat.high.push_back(std::min(2.0, point.cost_deg_per_h / lowest));  // beyond twice the best nobody looks
  }
  return Figure{"fig_surface",
                "The cost of the tuning over c and sigma2: " + method_text(row.spec),
                fmt::format("Survey grid of {} points, {}; cost over the lowest, cut at 2. A flat valley means that c "
                            "and sigma2 say little by themselves.",
                            t.surface.size(), tune_text(row.spec.tune)),
                {1, 380, {{"", {"c", true}, {"sigma2", true}, {}, {heat, chosen}}}}};
}

}  // namespace prism
