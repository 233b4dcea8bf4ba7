// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/svg_chart.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tools/prismcal/report/svg_scale.hpp"
#include "tools/prismcal/report/svg_series.hpp"
#include "tools/prismcal/report/svg_text.hpp"

namespace prism::report {
namespace {

constexpr double kWidth = 960, kLeft = 80, kBottom = 50, kLine = 15, kSample = 24, kEntryGap = 16, kTickRoom = 50;
constexpr const char* kTitleInk = " fill=\"#1b2733\"";

bool uses_right_axis(const Panel& panel) {
  return std::any_of(panel.series.begin(), panel.series.end(), [](const Series& s) { return s.right_axis; });
}

struct KeyEntry {
  const Series* series;
  std::string name;
  double width;
};

/// Lines above a panel: the wrapped key, and the title above it if both do not fit on one line.
struct Heading {
  std::vector<std::vector<KeyEntry>> key;
  bool title_above = false;
  std::size_t lines() const { return std::max<std::size_t>(1, key.size() + (title_above ? 1 : 0)); }
};

Heading heading_of(const Panel& panel, double width) {
  Heading heading;
  double used = 0;
  for (const Series& series : panel.series) {
    if (series.name.empty()) continue;
    std::string name = fitted(series.name, width - kSample - kEntryGap);
    const double entry = kSample + kEntryGap + text_width(name);
    if (heading.key.empty() || used + entry > width) {
      heading.key.emplace_back();
      used = 0;
    }
    heading.key.back().push_back({&series, std::move(name), entry});
    used += entry;
  }
  const bool same_line = heading.key.size() <= 1 && used + text_width(fitted(panel.title, width)) + kEntryGap <= width;
  heading.title_above = !panel.title.empty() && !heading.key.empty() && !same_line;
  return heading;
}

struct Ranges {
  Range x, y, right;
};

/// Adds the outer edges of the cells of a grid, or the values if there are fewer than two.
void add_cells(Range& range, const std::vector<double>& values, bool logarithmic) {
  std::vector<double> edges = grid_edges(values);
  if (edges.empty()) edges = values;
  for (const double edge : edges) {
    if (is_drawable(edge, logarithmic)) range.add(edge);
  }
}

Ranges ranges_of(const Panel& panel) {
  Ranges ranges;
  for (const Series& series : panel.series) {
    const bool log_x = panel.x.logarithmic, log_y = series.right_axis ? panel.right.logarithmic : panel.y.logarithmic;
    Range& y = series.right_axis ? ranges.right : ranges.y;
    if (series.form == SeriesStyle::kBars) add_cells(ranges.x, series.x, log_x);
    if (series.form == SeriesStyle::kBars && !log_y) y.add(0);
    for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
      if (!is_drawable(series.x[i], log_x) || !is_drawable(series.y[i], log_y)) continue;
      ranges.x.add(series.x[i]);
      y.add(series.y[i]);
      if (series.form == SeriesStyle::kBand && i < series.high.size() && is_drawable(series.high[i], log_y))
        y.add(series.high[i]);
    }
  }
  return ranges;
}

/// A panel, with the pixels of its frame in the drawing.
class PanelDrawing {
 public:
  PanelDrawing(const Panel& panel, Heading heading, double left, double right, double top, double bottom)
      : PanelDrawing(panel, std::move(heading), ranges_of(panel), left, right, top, bottom) {}

  std::string text(const std::string& id) const {
    std::string svg =
        grid() + fmt::format("<clipPath id=\"{}\"><path d=\"{}\"/></clipPath>\n<g clip-path=\"url(#{})\">\n", id,
                             box(left_ - 3, top_ - 3, right_ + 3, bottom_ + 3), id);
    for (const Series& series : panel_.series) svg += series_svg(series, x_, series.right_axis ? right_scale_ : y_);
    return svg + "</g>\n" + frame() + labels() + heading();
  }

 private:
  PanelDrawing(const Panel& panel, Heading heading, const Ranges& ranges, double left, double right, double top,
               double bottom)
      : panel_(panel),
        heading_(std::move(heading)),
        left_(left),
        right_(right),
        top_(top),
        bottom_(bottom),
        x_(panel.x, ranges.x, left, right, 60, false),
        y_(panel.y, ranges.y, bottom, top, 30, true),
        right_scale_(panel.right, ranges.right, bottom, top, 30, true) {}

  static std::string box(double left, double top, double right, double bottom) {
    return fmt::format("M{} {}H{}V{}H{}z", svg_number(left), svg_number(top), svg_number(right), svg_number(bottom),
                       svg_number(left));
  }

  std::string grid() const {
    std::string path;
    for (const Tick& tick : x_.ticks())
      path += fmt::format("M{} {}V{}", svg_number(tick.at_px), svg_number(top_), svg_number(bottom_));
    for (const Tick& tick : y_.ticks())
      path += fmt::format("M{} {}H{}", svg_number(left_), svg_number(tick.at_px), svg_number(right_));
    return fmt::format("<path d=\"{}\" stroke=\"#e5e7eb\" stroke-width=\"0.8\"/>\n", path);
  }

  /// The frame with tick marks.
  std::string frame() const {
    std::string path = box(left_, top_, right_, bottom_);
    const auto add_x = [&](double at, int length) {
      path += fmt::format("M{} {}v{}", svg_number(at), svg_number(bottom_), -length);
    };
    const auto add_y = [&](double edge, double at, int length) {
      path += fmt::format("M{} {}h{}", svg_number(edge), svg_number(at), length);
    };
    for (const Tick& tick : x_.ticks()) add_x(tick.at_px, 5);
    for (const double at : x_.minor_px()) add_x(at, 3);
    for (const Tick& tick : y_.ticks()) add_y(left_, tick.at_px, 5);
    for (const double at : y_.minor_px()) add_y(left_, at, 3);
    if (uses_right_axis(panel_)) {
      for (const Tick& tick : right_scale_.ticks()) add_y(right_, tick.at_px, -5);
    }
    return fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"#9ca3af\" stroke-width=\"0.8\"/>\n", path);
  }

  static std::string tick_label(double x, double y, const std::string& label, const char* anchor) {
    const bool wide = !label.starts_with("10<") && text_width(label) > kTickRoom;
    return fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"{}\"{}>{}</text>\n", svg_number(x), svg_number(y), anchor,
                       wide ? fmt::format(" textLength=\"{}\" lengthAdjust=\"spacingAndGlyphs\"", kTickRoom) : "",
                       label);
  }

  std::string labels() const {
    std::string svg;
    for (const Tick& tick : x_.ticks()) {
      const double half = tick.label.starts_with("10<") ? 12 : text_width(tick.label) / 2;
      svg += tick_label(std::min(tick.at_px, kWidth - half), bottom_ + 17, tick.label, "middle");
    }
    for (const Tick& tick : y_.ticks()) svg += tick_label(left_ - 6, tick.at_px + 4, tick.label, "end");
    const double middle = (top_ + bottom_) / 2, height = bottom_ - top_;
    svg += text_svg((left_ + right_) / 2, bottom_ + 36, fitted(panel_.x.label, right_ - left_), "middle");
    svg += upright(left_ - 63, middle, fitted(panel_.y.label, height));
    if (!uses_right_axis(panel_)) return svg;
    for (const Tick& tick : right_scale_.ticks()) svg += tick_label(right_ + 6, tick.at_px + 4, tick.label, "start");
    return svg + upright(right_ + 69, middle, fitted(panel_.right.label, height));
  }

  static std::string upright(double x, double y, const std::string& label) {
    return text_svg(x, y, label, "middle",
                    fmt::format(" transform=\"rotate(-90 {} {})\"", svg_number(x), svg_number(y)));
  }

  std::string heading() const {
    const double base = top_ - 8;
    std::string svg =
        text_svg(left_, base - (heading_.title_above ? kLine * static_cast<double>(heading_.key.size()) : 0),
                 fitted(panel_.title, right_ - left_), "start", kTitleInk);
    for (std::size_t line = 0; line < heading_.key.size(); ++line) {
      const double y = base - kLine * static_cast<double>(heading_.key.size() - 1 - line);
      double x = right_ + kEntryGap - 6;
      for (const KeyEntry& entry : heading_.key[line]) x -= entry.width;
      for (const KeyEntry& entry : heading_.key[line]) {
        svg += key_sample_svg(*entry.series, x, kSample, y - 4);
        svg += text_svg(x + kSample + 5, y, entry.name, "start", kTitleInk);
        x += entry.width;
      }
    }
    return svg;
  }

  const Panel& panel_;
  Heading heading_;
  double left_, right_, top_, bottom_;
  Scale x_, y_, right_scale_;
};

}  // namespace

std::string draw_svg(const Plot& plot, int figure_number) {
  const int count = static_cast<int>(plot.panels.size()), columns = std::clamp(plot.columns, 1, 6);
  const double right = std::any_of(plot.panels.begin(), plot.panels.end(), uses_right_axis) ? 74 : 14;
  const double cell = kWidth / columns, width = cell - kLeft - right;
  std::vector<Heading> headings;
  std::size_t lines = 1;
  for (const Panel& panel : plot.panels) {
    headings.push_back(heading_of(panel, width));
    lines = std::max(lines, headings.back().lines());
  }
  const double above = 20 + kLine * static_cast<double>(lines);
  const double height = std::max(plot.panel_height, above + kBottom + 60);
  const double all = height * std::max(1, (count + columns - 1) / columns);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"{2}\" fill=\"#374151\">\n",
      kWidth, all, kFontPx);
  for (int i = 0; i < count; ++i) {
    const auto p = static_cast<std::size_t>(i);
    const int row = i / columns;
    const double x = cell * (i % columns), y = height * row;
    svg += PanelDrawing(plot.panels[p], std::move(headings[p]), x + kLeft, x + cell - right, y + above,
                        y + height - kBottom)
               .text(fmt::format("plot{}-{}", figure_number, i));
  }
  return svg + "</svg>";
}

}  // namespace prism::report
