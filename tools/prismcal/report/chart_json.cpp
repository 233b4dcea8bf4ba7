// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/chart_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "tools/prismcal/report/curve_style.hpp"

namespace prism::report {
namespace {

using Json = nlohmann::ordered_json;

const char* form_name(SeriesStyle form) {
  switch (form) {
    case SeriesStyle::kLine:
      return "line";
    case SeriesStyle::kPoints:
      return "points";
    case SeriesStyle::kOpenPoints:
      return "open";
    case SeriesStyle::kLinePoints:
      return "linepoints";
    case SeriesStyle::kBand:
      return "band";
    case SeriesStyle::kBars:
      return "bars";
    case SeriesStyle::kHeat:
    case SeriesStyle::kMark:
      break;
  }
  return "";
}

bool is_curve(SeriesStyle form) {
  return form == SeriesStyle::kLine || form == SeriesStyle::kLinePoints || form == SeriesStyle::kBand;
}

bool can_be_charted(const Series& series, const Panel& panel) {
  if (*form_name(series.form) == '\0') return false;
  if (series.form == SeriesStyle::kBars && panel.x.logarithmic) return false;
  const bool log_y = series.right_axis ? panel.right.logarithmic : panel.y.logarithmic;
  double last = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
    if (!is_known(series, i)) continue;
    if ((panel.x.logarithmic && series.x[i] <= 0) || (log_y && series.y[i] <= 0)) return false;
    if (is_curve(series.form) && series.x[i] < last) return false;
    last = series.x[i];
  }
  return true;
}

bool has_point(const Panel& panel) {
  return std::any_of(panel.series.begin(), panel.series.end(), [](const Series& series) {
    for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i)
      if (is_known(series, i)) return true;
    return false;
  });
}

// Seven digits: more than the resolution of a screen.
Json number(double value) {
  if (!std::isfinite(value)) return nullptr;
  return std::stod(fmt::format("{:.7g}", value));
}

Json numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(number(value));
  return list;
}

Json axis_json(const Axis& axis) {
  Json json = {{"label", axis.label}};
  if (axis.logarithmic) json["log"] = true;
  if (axis.min) json["min"] = number(*axis.min);
  if (axis.max) json["max"] = number(*axis.max);
  return json;
}

Json series_json(const Series& series) {
  const CurveStyle style = curve_style(series.ink);
  Json json = {
      {"name", series.name}, {"form", form_name(series.form)}, {"colour", style.colour}, {"width", style.width}};
  if (*style.dash != '\0') json["dash"] = Json::parse(fmt::format("[{}]", style.dash));
  if (series.right_axis) json["right"] = true;
  json["x"] = numbers(series.x);
  json["y"] = numbers(series.y);
  if (series.form == SeriesStyle::kBand) json["high"] = numbers(series.high);
  return json;
}

Json panel_json(const Panel& panel) {
  Json series = Json::array();
  for (const Series& one : panel.series) series.push_back(series_json(one));
  return {{"title", panel.title},
          {"x", axis_json(panel.x)},
          {"y", axis_json(panel.y)},
          {"right", axis_json(panel.right)},
          {"series", std::move(series)}};
}

}  // namespace

bool can_be_charted(const Plot& plot) {
  return !plot.panels.empty() && std::all_of(plot.panels.begin(), plot.panels.end(), [](const Panel& panel) {
    return has_point(panel) && std::all_of(panel.series.begin(), panel.series.end(),
                                           [&](const Series& series) { return can_be_charted(series, panel); });
  });
}

std::string chart_json(const Plot& plot) {
  Json panels = Json::array();
  for (const Panel& panel : plot.panels) panels.push_back(panel_json(panel));
  const Json json = {
      {"columns", std::max(1, plot.columns)}, {"height", number(plot.panel_height)}, {"panels", std::move(panels)}};
  std::string text;
  for (const char c : prism::json_text(json)) text += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return text;
}

}  // namespace prism::report
