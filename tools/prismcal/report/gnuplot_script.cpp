// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include "tools/prismcal/report/curve_style.hpp"
#include "tools/prismcal/report/gnuplot.hpp"

namespace prism::report {
namespace {

/// Single quotes hold everything in gnuplot but themselves.
std::string literal(std::string_view text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
  return result + "'";
}

/// For what is drawn: a backslash keeps the text markup from reading it.
std::string quoted(const std::string& text) {
  std::string plain;
  for (const char c : text) {
    if (std::string_view("_^{}@&~\\").find(c) != std::string_view::npos) plain += '\\';
    plain += c;
  }
  return literal(plain);
}

void write_axis(std::string& script, const char* which, const Axis& axis) {
  script += fmt::format("set {}label {} textcolor rgb '#374151' offset {}\n", which, quoted(axis.label),
                        which[0] == 'x'   ? "0,0.4"
                        : which[1] == '2' ? "-1,0"
                                          : "0.8,0");
  script += fmt::format("{} logscale {}\n", axis.logarithmic ? "set" : "unset", which);
  script += fmt::format("set {}range [{}:{}]\n", which, axis.min ? fmt::format("{:.7g}", *axis.min) : "*",
                        axis.max ? fmt::format("{:.7g}", *axis.max) : "*");
  script += fmt::format("set format {} {}\n", which, axis.logarithmic ? "'10^{%T}'" : "'%g'");
}

std::string drawn(const Series& series, std::size_t panel, std::size_t index) {
  const CurveStyle l = curve_style(series.ink);
  const std::string data = fmt::format("$d{}_{}", panel, index);
  const std::string line = fmt::format("lw {} dt {} lc rgb '{}'", l.width, l.dash, l.colour);
  const std::string title = series.name.empty() ? "notitle" : "title " + quoted(series.name);
  const std::string axes = series.right_axis ? "axes x1y2 " : "";
  switch (series.form) {
    case Form::kLine:
      return fmt::format("{} using 1:2 {}with lines {} {}", data, axes, line, title);
    case Form::kPoints:
      return fmt::format("{} using 1:2 {}with points pt {} ps 0.28 lc rgb '{}' {}", data, axes, l.point, l.colour,
                         title);
    case Form::kOpenPoints:
      return fmt::format("{} using 1:2 {}with points pt {} ps 0.42 lw 0.8 lc rgb '{}' {}", data, axes, l.open_point,
                         l.colour, title);
    case Form::kLinePoints:
      return fmt::format("{} using 1:2 {}with linespoints pt {} ps 0.4 {} {}", data, axes, l.point, line, title);
    case Form::kBand:
      return fmt::format("{} using 1:2:3 {}with filledcurves fs transparent solid 0.22 noborder lc rgb '{}' {}", data,
                         axes, l.colour, title);
    case Form::kBars:
      return fmt::format("{} using 1:2 {}with boxes fs solid 0.75 noborder lc rgb '{}' {}", data, axes, l.colour,
                         title);
    case Form::kMark:
      return fmt::format("{} using 1:2 {}with points pt 2 ps 1.3 lw 2.5 lc rgb '{}' {}", data, axes, l.colour, title);
    case Form::kHeat:
      return fmt::format("{} using 1:2:3:4:5:6:7 with boxxyerror fs solid 1 noborder lc palette {}", data, title);
  }
  return {};
}

/// gnuplot refuses to choose a range for nothing at all: an axis of an empty panel gets one.
Axis with_range(Axis axis) {
  if (!axis.min) axis.min = axis.logarithmic ? 1 : 0;
  if (!axis.max) axis.max = axis.logarithmic ? 10 : 1;
  return axis;
}

bool is_empty(const Panel& panel) {
  for (const Series& series : panel.series) {
    for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
      if (std::isfinite(series.x[i]) && std::isfinite(series.y[i])) return false;
    }
  }
  return true;
}

bool uses_right_axis(const Panel& panel) {
  return std::any_of(panel.series.begin(), panel.series.end(), [](const Series& s) { return s.right_axis; });
}

constexpr double kLetter = 6.7;  // pixels, about

/// How many lines stand above a panel: the key wraps, and the title goes over it where both do not fit on one line.
struct Heading {
  int key_lines = 0;
  bool title_above = false;
  int lines() const { return std::max(1, key_lines + (title_above ? 1 : 0)); }
};

Heading heading_of(const Panel& panel, double width) {
  std::size_t longest = 0;
  int entries = 0;
  for (const Series& series : panel.series) {
    if (series.name.empty()) continue;
    longest = std::max(longest, series.name.size());
    ++entries;
  }
  if (entries == 0) return {};
  const double entry = kLetter * (static_cast<double>(longest) + 7);  // gnuplot makes all as wide as the widest
  const int in_a_line = std::max(1, static_cast<int>(width / entry));
  const double title = kLetter * (static_cast<double>(panel.title.size()) + 2);
  return {(entries + in_a_line - 1) / in_a_line, !panel.title.empty() && entries * entry + title > width};
}

/// 1, 2 or 5 times a power of ten, so that about `count` steps cover `span`.
double nice_step(double span, double count) {
  const double raw = span / std::max(1.0, count), power = std::pow(10, std::floor(std::log10(raw)));
  const double digit = raw / power;
  return power * (digit <= 1 ? 1 : digit <= 2 ? 2 : digit <= 5 ? 5 : 10);
}

/// "set ytics STEP" that leaves each label its room; gnuplot's own choice crowds low panels.
void write_tic_step(std::string& script, const char* which, const Panel& panel, bool right, double height) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const Series& series : panel.series) {
    if (series.right_axis != right) continue;
    for (const auto* values : {&series.y, &series.high}) {
      for (const double value : *values) {
        if (!std::isfinite(value)) continue;
        low = std::min(low, value);
        high = std::max(high, value);
      }
    }
  }
  const bool logarithmic = right ? panel.right.logarithmic : panel.y.logarithmic;
  if (logarithmic || !(high > low)) {
    script += fmt::format("set {}tics autofreq\n", which);
  } else {
    script += fmt::format("set {}tics {:.6g}\n", which, nice_step(high - low, height / 30));
  }
}

/// Where a panel stands, in shares of the picture: left, right, bottom, top.
struct PanelArea {
  double left, right, bottom, top;
  double height;  ///< of the panel's inside, pixels
  Heading heading;
};

/// Margins in pixels leave room for labels and the key line above each panel.
PanelArea area_of(const Plot& plot, std::size_t index) {
  constexpr double kWidth = 960, kLeft = 80, kBottom = 50;
  const int columns = std::max(1, plot.columns);
  const int rows = (static_cast<int>(plot.panels.size()) + columns - 1) / columns;
  const bool heat = std::any_of(plot.panels[index].series.begin(), plot.panels[index].series.end(),
                                [](const Series& s) { return s.form == Form::kHeat; });
  const double right = heat ? 78 : std::any_of(plot.panels.begin(), plot.panels.end(), uses_right_axis) ? 66 : 14;
  const double panel_width = kWidth / columns - kLeft - right;
  int lines = 1;
  for (const Panel& panel : plot.panels) lines = std::max(lines, heading_of(panel, panel_width).lines());
  const double above = 20 + 15 * lines;
  const double cell = kWidth / columns, height = plot.panel_height * rows;
  const int row = static_cast<int>(index) / columns, column = static_cast<int>(index) % columns;
  const double x = cell * column, y = plot.panel_height * row;
  return {(x + kLeft) / kWidth,     (x + cell - right) / kWidth,         1 - (y + plot.panel_height - kBottom) / height,
          1 - (y + above) / height, plot.panel_height - above - kBottom, heading_of(plot.panels[index], panel_width)};
}

void write_panel(std::string& script, const Panel& panel, std::size_t index, const PanelArea& area) {
  script += fmt::format("set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\n", area.left, area.right);
  script += fmt::format("set bmargin at screen {:.5f}\nset tmargin at screen {:.5f}\n", area.bottom, area.top);
  script += fmt::format("set label 1 {} at graph 0,1 left offset 0,{} textcolor rgb '#1b2733'\n", quoted(panel.title),
                        0.75 + 1.15 * (area.heading.title_above ? area.heading.key_lines : 0));
  const bool empty = is_empty(panel);
  write_axis(script, "x", empty ? with_range(panel.x) : panel.x);
  write_axis(script, "y", empty ? with_range(panel.y) : panel.y);
  const bool right = uses_right_axis(panel);
  script += right ? "" : "unset y2tics\nset y2label ''\n";
  write_tic_step(script, "y", panel, false, area.height);
  if (right) write_tic_step(script, "y2", panel, true, area.height);
  if (right) write_axis(script, "y2", empty ? with_range(panel.right) : panel.right);
  const bool named =
      std::any_of(panel.series.begin(), panel.series.end(), [](const Series& s) { return !s.name.empty(); });
  script += named ? "set key at graph 1,1 bottom right horizontal samplen 2.2 width 1\n" : "unset key\n";
  script += panel.series.empty() ? "plot NaN notitle" : "plot ";
  for (std::size_t s = 0; s < panel.series.size(); ++s) {
    if (s > 0) script += ", \\\n     ";
    script += drawn(panel.series[s], index, s);
  }
  script += '\n';
}

}  // namespace

std::string gnuplot_script(const Plot& plot, const std::string& name, const std::string& svg_file) {
  std::string script;
  const int columns = std::max(1, plot.columns);
  const int rows = (static_cast<int>(plot.panels.size()) + columns - 1) / columns;
  script += fmt::format(
      "set terminal svg enhanced dynamic size 960,{:.0f} font 'sans-serif,{}' name '{}' linewidth 1 dashlength 0.6\n"
      "set output {}\n",
      plot.panel_height * std::max(1, rows), columns > 1 ? 12 : 12.5, name, literal(svg_file));
  script +=
      "set encoding utf8\n"
      "set autoscale xfix\nset border linewidth 0.7 linecolor rgb '#9ca3af'\n"
      "set grid linecolor rgb '#e5e7eb' linewidth 0.6 dashtype solid\n"
      "set tics textcolor rgb '#374151' scale 0.5 nomirror\n"
      "set style fill noborder\nset boxwidth 0.9 relative\n"
      "set format cb '%.2f'\nset palette defined (0 '#12385f', 0.5 '#7fa3c7', 1 '#f6f0e4')\n";
  write_gnuplot_data(script, plot);
  script += "set multiplot\n";
  for (std::size_t p = 0; p < plot.panels.size(); ++p) write_panel(script, plot.panels[p], p, area_of(plot, p));
  script += "unset multiplot\n";
  return script;
}

}  // namespace prism::report
