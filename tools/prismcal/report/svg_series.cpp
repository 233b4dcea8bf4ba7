// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/svg_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "tools/prismcal/report/curve_style.hpp"

namespace prism::report {
namespace {

struct Point {
  double x, y;
};
using Run = std::vector<Point>;

std::size_t size_of(const Series& series) { return std::min(series.x.size(), series.y.size()); }

/// Pixels of `values` over the x of `series`, split at values that are not drawable.
std::vector<Run> runs_of(const Series& series, const std::vector<double>& values, const Scale& x, const Scale& y) {
  const bool band = series.form == SeriesStyle::kBand;
  std::vector<Run> runs(1);
  for (std::size_t i = 0; i < size_of(series); ++i) {
    const bool drawable =
        x.shows(series.x[i]) && y.shows(series.y[i]) && (!band || (i < series.high.size() && y.shows(series.high[i])));
    if (drawable) {
      runs.back().push_back({x.px(series.x[i]), y.px(values[i])});
    } else if (!runs.back().empty()) {
      runs.emplace_back();
    }
  }
  return runs;
}

/// Keeps the lowest and the highest point of each pixel column, in order.
Run reduced(const Run& run) {
  Run result;
  for (std::size_t begin = 0, end = 0; begin < run.size(); begin = end) {
    std::size_t low = begin, high = begin;
    for (end = begin; end < run.size() && std::floor(run[end].x) == std::floor(run[begin].x); ++end) {
      if (run[end].y < run[low].y) low = end;
      if (run[end].y > run[high].y) high = end;
    }
    result.push_back(run[std::min(low, high)]);
    if (low != high) result.push_back(run[std::max(low, high)]);
  }
  return result;
}

std::string numbers(double a, double b) { return svg_number(a) + " " + svg_number(b); }

/// "M x y L x y x y …"; a single point becomes a line of zero length.
void append_line(std::string& path, const Run& run) {
  for (std::size_t i = 0; i < run.size(); ++i)
    path += (i == 0 ? "M" : i == 1 ? "L" : " ") + numbers(run[i].x, run[i].y);
  if (run.size() == 1) path += "h0";
}

std::string path_element(const std::string& path, const std::string& attributes) {
  return path.empty() ? "" : fmt::format("<path d=\"{}\" {}/>\n", path, attributes);
}

std::string line_svg(const std::vector<Run>& runs, const CurveStyle& style) {
  std::string path;
  for (const Run& run : runs) append_line(path, reduced(run));
  const std::string dash =
      *style.dash == '\0' ? "stroke-linecap=\"round\"" : fmt::format("stroke-dasharray=\"{}\"", style.dash);
  return path_element(path, fmt::format("fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" {}",
                                        style.colour, style.width, dash));
}

/// Outline of a symbol, in relative coordinates.
std::string outline(Symbol symbol, double r) {
  const auto polygon = [r](std::initializer_list<Point> steps) {
    std::string path;
    for (const Point& step : steps) path += (path.empty() ? "m" : "l") + numbers(step.x * r, step.y * r);
    return path + "z";
  };
  switch (symbol) {
    case Symbol::kCircle:
      return fmt::format("m{} 0a{} {} 0 1 0 {} 0a{} {} 0 1 0 {} 0", svg_number(-r), svg_number(r), svg_number(r),
                         svg_number(2 * r), svg_number(r), svg_number(r), svg_number(-2 * r));
    case Symbol::kSquare:
      return polygon({{-0.9, -0.9}, {1.8, 0}, {0, 1.8}, {-1.8, 0}});
    case Symbol::kTriangle:
      return polygon({{0, -1.2}, {1.1, 2}, {-2.2, 0}});
    case Symbol::kTriangleDown:
      return polygon({{0, 1.2}, {1.1, -2}, {-2.2, 0}});
    case Symbol::kDiamond:
      return polygon({{0, -1.25}, {1.25, 1.25}, {-1.25, 1.25}, {-1.25, -1.25}});
    case Symbol::kPlus:
      return polygon({{-1, 0}, {2, 0}, {-1, 0}, {0, -1}, {0, 2}});
  }
  return {};
}

std::string points_svg(const std::vector<Run>& runs, const CurveStyle& style, double radius, bool filled) {
  std::set<std::pair<long, long>> covered;
  const bool dot =
      filled && style.symbol == Symbol::kCircle;  // a line of zero length with round ends: the shortest path
  const std::string symbol = dot ? "h0" : outline(style.symbol, radius);
  std::string path;
  for (const Run& run : runs) {
    for (const Point& point : run) {
      if (covered.emplace(std::lround(point.x / radius), std::lround(point.y / radius)).second)
        path += "M" + numbers(point.x, point.y) + symbol;
    }
  }
  if (dot) {
    return path_element(path, fmt::format("fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\"",
                                          style.colour, 2 * radius));
  }
  return path_element(path, fmt::format("fill=\"{}\" stroke=\"{}\" stroke-width=\"0.8\"",
                                        filled ? style.colour : "none", style.colour));
}

std::string band_svg(const std::vector<Run>& low, const std::vector<Run>& high, const CurveStyle& style) {
  std::string path;
  for (std::size_t i = 0; i < low.size(); ++i) {
    Run edge = reduced(low[i]);
    const Run upper = reduced(high[i]);
    if (edge.empty()) continue;
    edge.insert(edge.end(), upper.rbegin(), upper.rend());
    append_line(path, edge);
    path += "z";
  }
  return path_element(path, fmt::format("fill=\"{}\" fill-opacity=\"0.22\"", style.colour));
}

std::string bars_svg(const std::vector<Run>& runs, double base_px, const CurveStyle& style) {
  std::vector<double> middles;
  std::string path;
  for (const Run& run : runs) {
    for (const Point& bar : reduced(run)) {
      path += fmt::format("M{}V{}", numbers(bar.x, base_px), svg_number(bar.y));
      middles.push_back(bar.x);
    }
  }
  std::sort(middles.begin(), middles.end());
  double gap = HUGE_VAL;
  for (std::size_t i = 1; i < middles.size(); ++i) {
    if (middles[i] - middles[i - 1] > 0.01) gap = std::min(gap, middles[i] - middles[i - 1]);
  }
  return path_element(path, fmt::format("fill=\"none\" stroke=\"{}\" stroke-opacity=\"0.75\" stroke-width=\"{}\"",
                                        style.colour, svg_number(std::isfinite(gap) ? std::max(0.5, 0.9 * gap) : 40)));
}

/// Invisible circles with the values of few points: a browser shows them at the pointer.
std::string titles_svg(const Series& series, const Scale& x, const Scale& y) {
  constexpr std::size_t kMost = 100;
  const bool points = series.form == SeriesStyle::kPoints || series.form == SeriesStyle::kOpenPoints ||
                      series.form == SeriesStyle::kLinePoints;
  if (!points || size_of(series) > kMost) return {};
  std::string text;
  for (std::size_t i = 0; i < size_of(series); ++i) {
    if (x.shows(series.x[i]) && y.shows(series.y[i]))
      text += fmt::format("<path d=\"M{}h0\"><title>{:.4g}, {:.4g}</title></path>\n",
                          numbers(x.px(series.x[i]), y.px(series.y[i])), series.x[i], series.y[i]);
  }
  if (text.empty()) return {};
  return "<g fill=\"none\" stroke=\"#000\" stroke-opacity=\"0\" stroke-width=\"9\" stroke-linecap=\"round\">\n" + text +
         "</g>\n";
}

std::string form_svg(SeriesStyle form, const CurveStyle& style, const std::vector<Run>& runs,
                     const std::vector<Run>& high, double base_px) {
  switch (form) {
    case SeriesStyle::kLine:
      return line_svg(runs, style);
    case SeriesStyle::kPoints:
      return points_svg(runs, style, 1.3, true);
    case SeriesStyle::kOpenPoints:
      return points_svg(runs, style, 1.9, false);
    case SeriesStyle::kLinePoints:
      return line_svg(runs, style) + points_svg(runs, style, 1.8, true);
    case SeriesStyle::kBand:
      return band_svg(runs, high, style);
    case SeriesStyle::kBars:
      return bars_svg(runs, base_px, style);
  }
  return {};
}

}  // namespace

std::string series_svg(const Series& series, const Scale& x, const Scale& y) {
  const bool band = series.form == SeriesStyle::kBand;
  return form_svg(series.form, curve_style(series.ink), runs_of(series, series.y, x, y),
                  band ? runs_of(series, series.high, x, y) : std::vector<Run>(), y.base_px()) +
         titles_svg(series, x, y);
}

std::string key_sample_svg(const Series& series, double left, double width, double y) {
  const double middle = left + width / 2;
  switch (series.form) {
    case SeriesStyle::kLine:
      return form_svg(series.form, curve_style(series.ink), {{{left, y}, {left + width, y}}}, {}, y);
    case SeriesStyle::kLinePoints:
      return form_svg(series.form, curve_style(series.ink), {{{left, y}, {middle, y}, {left + width, y}}}, {}, y);
    case SeriesStyle::kBand:
      return form_svg(series.form, curve_style(series.ink), {{{left, y + 4}, {left + width, y + 4}}},
                      {{{left, y - 4}, {left + width, y - 4}}}, y);
    case SeriesStyle::kBars:
      return form_svg(series.form, curve_style(series.ink), {{{middle - 6, y - 4}, {middle + 6, y - 4}}}, {}, y + 4);
    default:
      return form_svg(series.form, curve_style(series.ink), {{{middle, y}}}, {}, y);
  }
}

}  // namespace prism::report
