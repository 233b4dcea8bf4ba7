// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "compensation/evaluation/allan_confidence.hpp"
#include "compensation/evaluation/correlation.hpp"
#include "compensation/evaluation/thermal_segments.hpp"
#include "tools/prismcal/evaluation/evidence.hpp"

namespace prism {
namespace {

using report::Figure;
using report::Form;
using report::Ink;
using report::Panel;
using report::Plot;
using report::Series;

constexpr const char* kTime = "time, h";
constexpr const char* kBias = "bias, deg/h";

Panel time_panel(const char* title, const char* unit, std::vector<Series> series) {
  return {title, {kTime}, {unit}, {}, std::move(series)};
}

Series curve(const char* name, Ink ink, const std::vector<double>& x, const std::vector<double>& y,
             Form form = Form::kLine) {
  return {name, ink, form, x, y};
}

bool has_uhfo(const BlockTable& table) {
  for (const Window& block : table.blocks) {
    if (std::isfinite(block.uhfo_v)) return true;
  }
  return false;
}

/// The points of (x, y) where `keep` says so.
template <class Keep>
Series picked(const char* name, Ink ink, Form form, const std::vector<double>& x, const std::vector<double>& y,
              const Keep& keep) {
  Series series{name, ink, form};
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!keep(i)) continue;
    series.x.push_back(x[i]);
    series.y.push_back(y[i]);
  }
  return series;
}

Panel loop_panel(const char* title, const BlockTable& table, const std::vector<double>& bias) {
  std::vector<double> time;
  for (const Window& block : table.blocks) time.push_back(static_cast<double>(block.bucket.second));
  const auto temperature = table.column(kInputTemperature);
  const auto kinds = thermal_kinds(time, temperature, SegmentSettings{}.soak_slope_degc_per_s);
  const auto of = [&](ThermalKind kind) { return [&kinds, kind](std::size_t i) { return kinds[i] == kind; }; };
  return {title,
          {"T, °C"},
          {kBias},
          {},
          {picked("soak", Ink::kRaw, Form::kPoints, temperature, bias, of(ThermalKind::kSoak)),
           picked("heating", Ink::kModel, Form::kPoints, temperature, bias, of(ThermalKind::kHeating)),
           picked("cooling", Ink::kCorrected, Form::kOpenPoints, temperature, bias, of(ThermalKind::kCooling))}};
}

/// A curve with its band, dense points.
Result<std::vector<Series>> allan_series(const std::vector<double>& seconds, const char* name, Ink ink,
                                         const std::string& where) {
  const auto sizes = allan_cluster_sizes(AllanGrid::kDense, seconds.size());
  const auto curve = allan_deviation(seconds, 1, sizes, AllanEstimator::kOverlapping, where);
  if (!curve) return tl::unexpected(curve.error());
  const auto intervals = allan_confidence(*curve, seconds, 0.683);
  Series band{"", ink, Form::kBand}, line{name, ink, Form::kLinePoints};
  for (std::size_t i = 0; i < curve->points.size(); ++i) {
    if (!(curve->points[i].deviation > 0)) continue;
    band.x.push_back(curve->points[i].tau_s);
    band.y.push_back(intervals[i].low);
    band.high.push_back(intervals[i].high);
    line.x.push_back(curve->points[i].tau_s);
    line.y.push_back(curve->points[i].deviation);
  }
  return std::vector<Series>{band, line};
}

Panel histogram_panel(const std::vector<double>& residual, const Spread& spread) {
  constexpr int kBins = 41;
  const double width = 8 * spread.sd / kBins, low = spread.mean - 4 * spread.sd;
  Series bars{"residual", Ink::kCorrected, Form::kBars}, normal{"normal", Ink::kModel, Form::kLine};
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
    normal.x.push_back(spread.mean + z * spread.sd);
    normal.y.push_back(static_cast<double>(residual.size()) * width / spread.sd * std::exp(-z * z / 2) /
                       std::sqrt(2 * std::numbers::pi));
  }
  return {"(a) histogram", {"residual, deg/h"}, {"blocks"}, {}, {bars, normal}};
}

Panel autocorrelation_panel(const Autocorrelation& r) {
  Series bars{"", Ink::kCorrected, Form::kBars};
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

Panel plane_panel(const char* title, const char* label, const std::string& input, const Evidence& evidence) {
  return {title,
          {"T, °C"},
          {label},
          {},
          {curve("training", Ink::kRaw, evidence.training->column(kInputTemperature), evidence.training->column(input),
                 Form::kPoints),
           picked("evaluated", Ink::kCorrected, Form::kOpenPoints, evidence.table->column(kInputTemperature),
                  evidence.table->column(input), [&](std::size_t i) { return !evidence.judgement->extrapolating[i]; }),
           picked("off the data", Ink::kModel, Form::kPoints, evidence.table->column(kInputTemperature),
                  evidence.table->column(input), [&](std::size_t i) { return evidence.judgement->extrapolating[i]; })}};
}

}  // namespace

Figure record_figure(const BlockTable& table, const std::string& id) {
  const auto hours = table.hours();
  Figure figure{id + "_record", "The recording " + table.name, fmt::format("{} s means.", table.features.length_s), {}};
  figure.plot.panel_height = 180;
  auto& panels = figure.plot.panels;
  panels.push_back(
      time_panel("temperature", "T, °C", {curve("", Ink::kModel, hours, table.column(kInputTemperature))}));
  panels.push_back(
      time_panel("slope of temperature", "dT/dt, °C/s", {curve("", Ink::kModel, hours, table.column(kInputSlope))}));
  if (has_uhfo(table)) {
    panels.push_back(
        time_panel("high-frequency oscillator", "UHFO, V", {curve("", Ink::kModel, hours, table.column(kInputUhfo))}));
  }
  panels.push_back(
      time_panel("rate less earth rate", kBias, {curve("", Ink::kCorrected, hours, table.bias_deg_per_h)}));
  return figure;
}

Figure bias_figure(const Evidence& evidence) {
  const BlockTable& table = *evidence.table;
  const Judgement& judged = *evidence.judgement;
  const auto hours = table.hours();
  Figure figure{evidence.id + "_bias",
                "Bias, model and what is left on " + table.name,
                fmt::format("{} s means.", table.features.length_s),
                {}};
  figure.plot.panel_height = 230;
  figure.plot.panels = {time_panel("(a) bias and model", kBias,
                                   {curve("bias", Ink::kRaw, hours, table.bias_deg_per_h),
                                    curve("model", Ink::kModel, hours, judged.predicted_deg_per_h)}),
                        time_panel("(b) before and after", kBias,
                                   {curve("before", Ink::kRaw, hours, table.bias_deg_per_h),
                                    curve("after", Ink::kCorrected, hours, judged.corrected_deg_per_h)})};
  if (judged.extrapolated > 0) {
    figure.plot.panels[1].series.push_back(picked("model asked off its data", Ink::kModel, Form::kPoints, hours,
                                                  judged.corrected_deg_per_h,
                                                  [&](std::size_t i) { return judged.extrapolating[i]; }));
  }
  return figure;
}

Figure thermal_figure(const Evidence& evidence) {
  Figure figure{evidence.id + "_loop",
                "Bias against temperature on " + evidence.table->name,
                "Means as above; soaks are light.",
                {}};
  figure.plot = {2,
                 320,
                 {loop_panel("(a) before", *evidence.table, evidence.table->bias_deg_per_h),
                  loop_panel("(b) after", *evidence.table, evidence.judgement->corrected_deg_per_h)}};
  return figure;
}

Result<Figure> allan_figure(const Evidence& evidence) {
  const BlockTable& table = *evidence.table;
  Panel panel{"", {"averaging time, s", true}, {"Allan deviation, deg/h", true}, {}, {}};
  for (const bool after : {false, true}) {
    const auto seconds = after ? corrected_seconds(*evidence.judgement, table) : table.second_bias_deg_per_h;
    const auto series =
        allan_series(seconds, after ? "after" : "before", after ? Ink::kCorrected : Ink::kModel, table.name);
    if (!series) return tl::unexpected(series.error());
    panel.series.insert(panel.series.end(), series->begin(), series->end());
  }
  return Figure{evidence.id + "_allan_curve",
                "Allan deviation on " + table.name,
                "Overlapping, 1 Hz means; bands are 68 % by chi-square with the degrees of freedom of the noise found "
                "at each time.",
                {1, 380, {panel}}};
}

Result<Figure> residual_figure(const Evidence& evidence) {
  const auto& residual = evidence.judgement->corrected_deg_per_h;
  const auto r = autocorrelate(residual, 60, evidence.table->name + ", corrected");
  if (!r) return tl::unexpected(r.error());
  return Figure{
      evidence.id + "_residual",
      "What is left on " + evidence.table->name,
      fmt::format(
          "{} s means; bins over four sigma either way. A residual without memory stays inside the dashed lines.",
          evidence.table->features.length_s),
      {2, 290, {histogram_panel(residual, evidence.judgement->stability.after), autocorrelation_panel(*r)}}};
}

Figure weights_figure(const Evidence& evidence) {
  const BlockTable& training = *evidence.training;
  const auto& weights = *evidence.weights;
  const auto hours = training.hours();
  const auto outlier = [&](std::size_t i) { return i < weights.size() && weights[i] < 0.5; };
  Figure figure{evidence.id + "_weights",
                "Which training blocks were called outliers",
                "A block counts by its weight; below one half it is marked.",
                {}};
  figure.plot.panel_height = 210;
  figure.plot.panels = {
      time_panel("(a) training bias", kBias,
                 {curve("bias", Ink::kRaw, hours, training.bias_deg_per_h),
                  picked("weight below 0.5", Ink::kModel, Form::kPoints, hours, training.bias_deg_per_h, outlier)}),
      time_panel("(b) weights", "weight", {curve("", Ink::kCorrected, hours, weights, Form::kPoints)})};
  return figure;
}

Figure domain_figure(const Evidence& evidence) {
  Figure figure{evidence.id + "_domain",
                "Where the model was trained and where it was asked",
                fmt::format("{} of {} blocks lie off the training data by the model's own guard.",
                            evidence.judgement->extrapolated, evidence.table->size()),
                {}};
  figure.plot = {2, 320, {plane_panel("(a) slope", "dT/dt, °C/s", kInputSlope, evidence)}};
  if (has_uhfo(*evidence.training) && has_uhfo(*evidence.table)) {
    figure.plot.panels.push_back(plane_panel("(b) oscillator", "UHFO, V", kInputUhfo, evidence));
  }
  return figure;
}

}  // namespace prism
