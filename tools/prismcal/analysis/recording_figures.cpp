// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "compensation/evaluation/correlation.hpp"
#include "compensation/evaluation/thermal_segments.hpp"
#include "tools/prismcal/analysis/recording_meanings.hpp"
#include "tools/prismcal/analysis/recording_report.hpp"

namespace prism::analysis {
namespace {

using report::Figure;
using report::Ink;
using report::Panel;
using report::Plot;
using report::Series;
using report::SeriesStyle;

constexpr const char* kTime = "time, h";
constexpr const char* kBias = "bias, deg/h";

Panel time_panel(const char* title, const char* unit, std::vector<Series> series) {
  return {title, {kTime}, {unit}, {}, std::move(series)};
}

Series curve(const char* name, Ink ink, const std::vector<double>& x, const std::vector<double>& y,
             SeriesStyle form = SeriesStyle::kLine) {
  return {name, ink, form, x, y};
}

bool has_uhfo(const recordings::BlockTable& table) {
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (std::isfinite(table.blocks[i].uhfo_v)) return true;
  }
  return false;
}

/// The points of (x, y) for which `keep` returns true.
template <class Keep>
Series picked(const char* name, Ink ink, SeriesStyle form, const std::vector<double>& x, const std::vector<double>& y,
              const Keep& keep) {
  Series series{name, ink, form};
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!keep(i)) continue;
    series.x.push_back(x[i]);
    series.y.push_back(y[i]);
  }
  return series;
}

Panel loop_panel(const char* title, const recordings::BlockTable& table, const std::vector<double>& bias) {
  std::vector<double> time;
  for (std::size_t i = 0; i < table.size(); ++i) time.push_back(static_cast<double>(table.second(i)));
  const auto temperature = table.column(compensation::kInputTemperature);
  const auto kinds =
      evaluation::thermal_kinds(time, temperature, evaluation::ThermalSegmentSettings{}.soak_slope_degc_per_s);
  const auto of = [&](evaluation::ThermalKind kind) {
    return [&kinds, kind](std::size_t i) { return kinds[i] == kind; };
  };
  return {
      title,
      {"T, °C"},
      {kBias},
      {},
      {picked("soak", Ink::kRaw, SeriesStyle::kPoints, temperature, bias, of(evaluation::ThermalKind::kSoak)),
       picked("heating", Ink::kModel, SeriesStyle::kPoints, temperature, bias, of(evaluation::ThermalKind::kHeating)),
       picked("cooling", Ink::kCorrected, SeriesStyle::kOpenPoints, temperature, bias,
              of(evaluation::ThermalKind::kCooling))}};
}

/// A curve of octave points with its confidence band.
std::vector<Series> allan_series(const evaluation::AllanAnalysis& analysis, const char* name, Ink ink) {
  Series band{"", ink, SeriesStyle::kBand}, line{name, ink, SeriesStyle::kLinePoints};
  for (const evaluation::AllanPoint& point : analysis.points) {
    band.x.push_back(point.tau_s);
    band.y.push_back(point.low);
    band.high.push_back(point.high);
    line.x.push_back(point.tau_s);
    line.y.push_back(point.deviation);
  }
  return {band, line};
}

/// The two curves at the averaging times that both have.
std::string compared(const Series& before, const Series& after) {
  std::vector<double> tau_s, first, second;
  for (std::size_t i = 0, j = 0; i < before.x.size() && j < after.x.size();) {
    if (before.x[i] == after.x[j]) {
      tau_s.push_back(before.x[i]);
      first.push_back(before.y[i++]);
      second.push_back(after.y[j++]);
    } else {
      ++(before.x[i] < after.x[j] ? i : j);
    }
  }
  return allan_curve_meaning(tau_s, first, second);
}

Panel histogram_panel(const std::vector<double>& residual, const evaluation::SummaryStatistics& summary) {
  constexpr int kBins = 41;
  const double width = 8 * summary.sd / kBins, low = summary.mean - 4 * summary.sd;
  Series bars{"residual", Ink::kCorrected, SeriesStyle::kBars}, normal{"normal", Ink::kModel, SeriesStyle::kLine};
  std::vector<double> count(kBins, 0);
  for (const double value : residual) {
    const double bin = std::floor((value - low) / width);
    if (bin >= 0 && bin < kBins) count[static_cast<std::size_t>(bin)] += 1;
  }
  for (int i = 0; i < kBins; ++i) {
    bars.x.push_back(low + (i + 0.5) * width);
    bars.y.push_back(count[static_cast<std::size_t>(i)]);
  }
  for (double z = -4; z <= 4.001; z += 0.1) {
    normal.x.push_back(summary.mean + z * summary.sd);
    normal.y.push_back(static_cast<double>(residual.size()) * width / summary.sd * std::exp(-z * z / 2) /
                       std::sqrt(2 * std::numbers::pi));
  }
  return {"(a) histogram", {"residual, deg/h"}, {"blocks"}, {}, {bars, normal}};
}

Panel autocorrelation_panel(const evaluation::Autocorrelation& r) {
  Series bars{"", Ink::kCorrected, SeriesStyle::kBars};
  for (std::size_t lag = 1; lag < r.coefficient.size(); ++lag) {
    bars.x.push_back(static_cast<double>(lag));
    bars.y.push_back(r.coefficient[lag]);
  }
  const std::vector<double> ends = {0.5, static_cast<double>(r.coefficient.size()) - 0.5};
  return {"(b) autocorrelation",
          {"lag, blocks"},
          {"r"},
          {},
          {bars, curve("95 % of white noise", Ink::kGuide, ends, {r.band, r.band}),
           curve("", Ink::kGuide, ends, {-r.band, -r.band})}};
}

Panel plane_panel(const char* title, const char* label, const std::string& input, const EvaluatedRecording& recording) {
  return {title,
          {"T, °C"},
          {label},
          {},
          {curve("training", Ink::kRaw, recording.training->column(compensation::kInputTemperature),
                 recording.training->column(input), SeriesStyle::kPoints),
           picked("evaluated", Ink::kCorrected, SeriesStyle::kOpenPoints,
                  recording.table->column(compensation::kInputTemperature), recording.table->column(input),
                  [&](std::size_t i) { return !recording.evaluation->extrapolating[i]; }),
           picked("outside the training range", Ink::kModel, SeriesStyle::kPoints,
                  recording.table->column(compensation::kInputTemperature), recording.table->column(input),
                  [&](std::size_t i) { return recording.evaluation->extrapolating[i]; })}};
}

}  // namespace

Figure record_figure(const recordings::BlockTable& table, const std::string& id) {
  const auto hours = table.hours();
  Figure figure{id + "_record", "The recording " + table.name, fmt::format("{} s means.", table.features.length_s), {}};
  figure.plot.panel_height = 180;
  auto& panels = figure.plot.panels;
  panels.push_back(time_panel("temperature", "T, °C",
                              {curve("", Ink::kModel, hours, table.column(compensation::kInputTemperature))}));
  panels.push_back(time_panel("slope of temperature", "dT/dt, °C/s",
                              {curve("", Ink::kModel, hours, table.column(compensation::kInputSlope))}));
  if (has_uhfo(table)) {
    panels.push_back(time_panel("high-frequency oscillator", "UHFO, V",
                                {curve("", Ink::kModel, hours, table.column(compensation::kInputUhfo))}));
  }
  panels.push_back(time_panel("rate − Earth rate", kBias, {curve("", Ink::kCorrected, hours, table.bias_deg_per_h)}));
  figure.meaning = record_meaning(table);
  return figure;
}

Figure bias_figure(const EvaluatedRecording& recording) {
  const recordings::BlockTable& table = *recording.table;
  const ModelEvaluation& evaluated = *recording.evaluation;
  const auto hours = table.hours();
  Figure figure{recording.id + "_bias",
                "Bias, model and residual on " + table.name,
                fmt::format("{} s means.", table.features.length_s),
                {}};
  figure.plot.panel_height = 230;
  figure.plot.panels = {time_panel("(a) bias and model", kBias,
                                   {curve("bias", Ink::kRaw, hours, table.bias_deg_per_h),
                                    curve("model", Ink::kModel, hours, evaluated.predicted_deg_per_h)}),
                        time_panel("(b) before and after", kBias,
                                   {curve("before", Ink::kRaw, hours, table.bias_deg_per_h),
                                    curve("after", Ink::kCorrected, hours, evaluated.corrected_deg_per_h)})};
  if (evaluated.extrapolated > 0) {
    figure.plot.panels[1].series.push_back(picked("outside the training range", Ink::kModel, SeriesStyle::kPoints,
                                                  hours, evaluated.corrected_deg_per_h,
                                                  [&](std::size_t i) { return evaluated.extrapolating[i]; }));
  }
  figure.meaning = bias_meaning(table, evaluated.corrected_deg_per_h);
  return figure;
}

Figure thermal_figure(const EvaluatedRecording& recording) {
  Figure figure{recording.id + "_loop",
                "Bias against temperature on " + recording.table->name,
                "Means as above; soaks in a light colour.",
                {}};
  figure.plot = {2,
                 320,
                 {loop_panel("(a) before", *recording.table, recording.table->bias_deg_per_h),
                  loop_panel("(b) after", *recording.table, recording.evaluation->corrected_deg_per_h)}};
  const auto before = measure_loop(recording, recording.table->bias_deg_per_h),
             after = measure_loop(recording, recording.evaluation->corrected_deg_per_h);
  figure.meaning = loop_meaning(before.value_or(evaluation::Hysteresis{}), after.value_or(evaluation::Hysteresis{}));
  return figure;
}

Result<Figure> allan_figure(const EvaluatedRecording& recording, const AllanPair& allan) {
  Panel panel{"", {"averaging time, s", true}, {"Allan deviation, deg/h", true}, {}, {}};
  for (const bool after : {false, true}) {
    const auto& analysis = after ? allan.after : allan.before;
    if (!analysis) return tl::unexpected(analysis.error());
    const auto series = allan_series(*analysis, after ? "after" : "before", after ? Ink::kCorrected : Ink::kModel);
    panel.series.insert(panel.series.end(), series.begin(), series.end());
  }
  const std::string meaning = compared(panel.series[1], panel.series[3]);  // each curve is a band and a line
  return Figure{recording.id + "_allan_curve",
                "Allan deviation on " + recording.table->name,
                "Overlapping, 1 Hz means. Bands: 68 %, chi-square with the degrees of freedom of the fitted noises.",
                {1, 380, {panel}},
                meaning};
}

Result<Figure> residual_figure(const EvaluatedRecording& recording) {
  const auto residual = recording.evaluation->where_corrected(recording.evaluation->corrected_deg_per_h);
  const auto r = evaluation::autocorrelate(residual, 60, recording.table->name + ", corrected");
  if (!r) return tl::unexpected(r.error());
  return Figure{
      recording.id + "_residual",
      "Residual on " + recording.table->name,
      fmt::format("{} s means; bins from −4 to +4 sigma. 95 % of the lags of white noise are within the dashed lines.",
                  recording.table->features.length_s),
      {2, 290, {histogram_panel(residual, recording.evaluation->stability.after), autocorrelation_panel(*r)}},
      residual_meaning(*r, recording.table->features.length_s)};
}

Figure domain_figure(const EvaluatedRecording& recording) {
  Figure figure{recording.id + "_domain",
                "Training range of the model and this recording",
                fmt::format("{} of {} blocks are outside the training range, by the model's extrapolation guard.",
                            recording.evaluation->extrapolated, recording.table->size()),
                {}};
  figure.plot = {2, 320, {plane_panel("(a) slope", "dT/dt, °C/s", compensation::kInputSlope, recording)}};
  if (has_uhfo(*recording.training) && has_uhfo(*recording.table)) {
    figure.plot.panels.push_back(plane_panel("(b) oscillator", "UHFO, V", compensation::kInputUhfo, recording));
  }
  figure.meaning = domain_meaning(recording.evaluation->extrapolated, recording.table->size());
  return figure;
}

}  // namespace prism::analysis
