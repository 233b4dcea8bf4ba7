// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "base/escape.hpp"
#include "tools/prismcal/document.hpp"

namespace prism::report {
namespace {

constexpr double kWidth = 960, kLeft = 80, kRight = 14, kAbove = 35, kBottom = 50, kSample = 24, kEntryGap = 16,
                 kTickRoom = 50, kFontPx = 12.5;
constexpr double kLargest = 1e150, kSmallestSpan = 1e-12, kRounding = 1e-6;
constexpr const char* kTitleInk = " fill=\"#1b2733\"";

// Text.

/// Prints up to two decimals, limited to ±20000; 0 for NaN.
std::string svg_number(double pixels) {
  std::string text = fmt::format("{:.2f}", std::isnan(pixels) ? 0 : std::clamp(pixels, -20000.0, 20000.0));
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string numbers(double a, double b) { return svg_number(a) + " " + svg_number(b); }

/// Estimated pixels of a line of text in a sans-serif font; slightly more than most fonts need.
double text_width(std::string_view text) {
  const auto begins_character = [](char byte) { return (byte & 0xC0) != 0x80; };
  return 0.63 * kFontPx * static_cast<double>(std::ranges::count_if(text, begins_character));
}

/// `anchor`: start, middle or end. `more`: additional attributes.
std::string text_svg(double x, double y, std::string_view text, const char* anchor, std::string_view more = {}) {
  if (text.empty()) return {};
  return fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"{}\"{}>{}</text>\n", svg_number(x), svg_number(y), anchor,
                     more, html_text(text));
}

std::string path_svg(const std::string& path, const std::string& attributes) {
  return path.empty() ? "" : fmt::format("<path d=\"{}\" {}/>\n", path, attributes);
}

// Axes.

/// Returns false for NaN, infinite values, values so large that differences overflow, and values ≤ 0 on a logarithmic
/// axis.
bool is_drawable(double value, bool logarithmic) {
  return std::abs(value) < kLargest && (!logarithmic || value > 1 / kLargest);
}

/// Returns 1, 2 or 5 times a power of ten, so that about `count` steps cover `span`.
double nice_step(double span, double count) {
  const double raw = span / std::max(1.0, count), power = std::pow(10, std::floor(std::log10(raw)));
  const double digit = raw / power;
  return power * (digit <= 1 ? 1 : digit <= 2 ? 2 : digit <= 5 ? 5 : 10);
}

/// Enough digits to distinguish neighbouring ticks.
std::string number_label(double value, double step) {
  if (std::abs(value) < kRounding * step) return "0";
  const int digits = static_cast<int>(std::floor(std::log10(std::abs(value))) - std::floor(std::log10(step))) + 1;
  return fmt::format("{:.{}g}", value, std::clamp(digits, 6, 15));
}

struct Tick {
  double at_px;
  std::string label;  ///< content of an SVG text element: digits, or 10 with a raised exponent
  bool is_power() const { return label.starts_with("10<"); }
};

/// Range, conversion of values to pixels, and ticks.
class Scale {
 public:
  /// `low_px`, `high_px`: pixels of both ends. `room_px`: minimum distance of ticks. `extend`: extends the range to the
  /// next ticks. If `data` is empty, the range is 0 to 1, or 1 to 10.
  Scale(const Axis& axis, Range data, double low_px, double high_px, double room_px, bool extend)
      : logarithmic_(axis.logarithmic), low_px_(low_px), high_px_(high_px) {
    if (data.low > data.high) data = logarithmic_ ? Range{1, 10} : Range{0, 1};
    low_ = logarithmic_ ? std::log10(data.low) : data.low;
    high_ = logarithmic_ ? std::log10(data.high) : data.high;
    const double smallest = std::max(logarithmic_ ? 1e-9 : 1 / kLargest,  // keeps ticks different
                                     kSmallestSpan * std::max(std::abs(low_), std::abs(high_)));
    if (!(high_ - low_ > smallest)) {
      const double room = std::abs(low_) > 1 / kLargest && !logarithmic_ ? 0.05 * std::abs(low_) : 0.5;
      high_ = low_ + room;  // one value
      low_ -= room;
    }
    const double count = std::abs(high_px - low_px) / (logarithmic_ ? std::max(20.0, 0.6 * room_px) : room_px);
    const double step = std::max(nice_step(high_ - low_, count), logarithmic_ ? 1.0 : 0.0);
    if (extend && (!logarithmic_ || high_ - low_ > 1)) {
      low_ = step * std::floor(low_ / step + kRounding);
      high_ = step * std::ceil(high_ / step - kRounding);
    }
    if (!logarithmic_) {
      add_linear_ticks(low_, high_, step);
    } else if (high_ - low_ < 0.7) {
      const double low = std::pow(10, low_), high = std::pow(10, high_);
      add_linear_ticks(low, high, nice_step(high - low, count));
    } else {
      add_powers(step, room_px);
    }
  }

  bool shows(double value) const { return is_drawable(value, logarithmic_); }
  /// `value` must be drawable.
  double px(double value) const { return at(logarithmic_ ? std::log10(value) : value); }
  const std::vector<Tick>& ticks() const { return ticks_; }
  /// Ticks without labels: 2 to 9 times the powers of ten on a logarithmic axis.
  const std::vector<double>& minor_px() const { return minor_px_; }

 private:
  double at(double position) const { return low_px_ + (position - low_) / (high_ - low_) * (high_px_ - low_px_); }

  void add_linear_ticks(double low, double high, double step) {
    for (double i = std::ceil(low / step - kRounding); i * step <= high + kRounding * step; ++i)
      ticks_.push_back({px(i * step), number_label(i * step, step)});
  }

  /// Over two decades and more, labels at each step of the powers of ten; else at 1, 2 and 5 times them, unless they
  /// would touch.
  void add_powers(double step, double room_px) {
    const bool few = high_ - low_ < 2;
    for (double power = std::floor(low_); power <= high_ + kRounding; ++power) {
      for (int digit = 1; digit < 10; ++digit) {
        const double position = power + std::log10(digit);
        if (position < low_ - kRounding || position > high_ + kRounding) continue;
        const bool touches = !ticks_.empty() && std::abs(at(position) - ticks_.back().at_px) < 0.5 * room_px;
        if (few && (digit == 1 || digit == 2 || digit == 5) && !touches)
          ticks_.push_back({at(position), fmt::format("{:g}", digit * std::pow(10, power))});
        else if (!few && digit == 1 && std::remainder(power, step) == 0)
          ticks_.push_back(
              {at(position), fmt::format("10<tspan dy=\"-4\" font-size=\"9\">{:.0f}</tspan>", power + 0.0)});
        else if (!few && digit > 1 && step == 1 && position < high_)
          minor_px_.push_back(at(position));
      }
    }
  }

  bool logarithmic_;
  double low_ = 0, high_ = 0;  // of log10 on a logarithmic axis
  double low_px_, high_px_;
  std::vector<Tick> ticks_{};
  std::vector<double> minor_px_{};
};

// Series.

struct CurveStyle {
  const char* colour;
  double width_px;
  bool dashed = false;
};

const CurveStyle& curve_style(Ink ink) {
  static constexpr CurveStyle kStyles[] = {
      {"#9db2c7", 1.3}, {"#c2410c", 1.8}, {"#12385f", 1.4}, {"#6b7280", 1.0, true}};  // in the order of Ink
  return kStyles[static_cast<std::size_t>(ink)];
}

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

/// "M x y L x y x y …"; a single point becomes a line of zero length.
void append_line(std::string& path, const Run& run) {
  for (std::size_t i = 0; i < run.size(); ++i)
    path += (i == 0 ? "M" : i == 1 ? "L" : " ") + numbers(run[i].x, run[i].y);
  if (run.size() == 1) path += "h0";
}

std::string line_svg(const std::vector<Run>& runs, const CurveStyle& style) {
  std::string path;
  for (const Run& run : runs) append_line(path, run);
  return path_svg(
      path, fmt::format("fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" {}", style.colour,
                        style.width_px, style.dashed ? "stroke-dasharray=\"5,4\"" : "stroke-linecap=\"round\""));
}

/// Filled points are lines of zero length with round ends: the shortest path.
std::string points_svg(const std::vector<Run>& runs, const CurveStyle& style, double radius, bool filled) {
  const std::string r = svg_number(radius), back = svg_number(-2 * radius), forth = svg_number(2 * radius);
  const std::string circle =
      filled ? "h0" : fmt::format("m-{0} 0a{0} {0} 0 1 0 {1} 0a{0} {0} 0 1 0 {2} 0", r, forth, back);
  std::string path;
  for (const Run& run : runs) {
    for (const Point& point : run) path += "M" + numbers(point.x, point.y) + circle;
  }
  return path_svg(path, filled ? fmt::format("fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\"",
                                             style.colour, 2 * radius)
                               : fmt::format("fill=\"none\" stroke=\"{}\" stroke-width=\"0.8\"", style.colour));
}

std::string band_svg(const std::vector<Run>& low, const std::vector<Run>& high, const CurveStyle& style) {
  std::string path;
  for (std::size_t i = 0; i < low.size(); ++i) {
    Run edge = low[i];
    if (edge.empty()) continue;
    edge.insert(edge.end(), high[i].rbegin(), high[i].rend());
    append_line(path, edge);
    path += "z";
  }
  return path_svg(path, fmt::format("fill=\"{}\" fill-opacity=\"0.22\"", style.colour));
}

std::string form_svg(const Series& series, const std::vector<Run>& runs, const std::vector<Run>& high) {
  const CurveStyle& style = curve_style(series.ink);
  switch (series.form) {
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
  }
  return {};
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

std::string series_svg(const Series& series, const Scale& x, const Scale& y) {
  const bool band = series.form == SeriesStyle::kBand;
  return form_svg(series, runs_of(series, series.y, x, y),
                  band ? runs_of(series, series.high, x, y) : std::vector<Run>()) +
         titles_svg(series, x, y);
}

/// Sample of a series in the key: kSample pixels wide, centred at `y`.
std::string key_sample_svg(const Series& series, double left, double y) {
  const double middle = left + kSample / 2, right = left + kSample;
  const bool points = series.form == SeriesStyle::kPoints || series.form == SeriesStyle::kOpenPoints;
  if (series.form == SeriesStyle::kBand)
    return form_svg(series, {{{left, y + 4}, {right, y + 4}}}, {{{left, y - 4}, {right, y - 4}}});
  return form_svg(series, {points ? Run{{middle, y}} : Run{{left, y}, {middle, y}, {right, y}}}, {});
}

// Panels.

/// Of the drawable values of a panel.
std::pair<Range, Range> ranges_of(const Panel& panel) {
  Range x, y;
  for (const Series& series : panel.series) {
    for (std::size_t i = 0; i < size_of(series); ++i) {
      if (!is_drawable(series.x[i], panel.x.logarithmic) || !is_drawable(series.y[i], panel.y.logarithmic)) continue;
      x.add(series.x[i]), y.add(series.y[i]);
      const bool band = series.form == SeriesStyle::kBand && i < series.high.size();
      if (band && is_drawable(series.high[i], panel.y.logarithmic)) y.add(series.high[i]);
    }
  }
  return {x, y};
}

std::string tick_label(double x, double y, const Tick& tick, const char* anchor) {
  const bool wide = !tick.is_power() && text_width(tick.label) > kTickRoom;
  return fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"{}\"{}>{}</text>\n", svg_number(x), svg_number(y), anchor,
                     wide ? fmt::format(" textLength=\"{}\" lengthAdjust=\"spacingAndGlyphs\"", kTickRoom) : "",
                     tick.label);
}

/// The names of the series with a sample each, above the right end of a panel.
std::string key_svg(const Panel& panel, double right, double y) {
  const auto width = [](const Series& series) { return kSample + kEntryGap + text_width(series.name); };
  double x = right + kEntryGap - 6;
  std::string svg;
  for (const Series& series : panel.series) x -= series.name.empty() ? 0 : width(series);
  for (const Series& series : panel.series) {
    if (series.name.empty()) continue;
    svg += key_sample_svg(series, x, y - 4) + text_svg(x + kSample + 5, y, series.name, "start", kTitleInk);
    x += width(series);
  }
  return svg;
}

/// A panel whose frame has these pixels in the drawing.
std::string panel_svg(const Panel& panel, double left, double right, double top, double bottom) {
  const auto [x_range, y_range] = ranges_of(panel);
  const Scale x(panel.x, x_range, left, right, 60, false), y(panel.y, y_range, bottom, top, 30, true);
  std::string grid, labels, series_text,
      frame = fmt::format("M{}H{}V{}H{}z", numbers(left, top), svg_number(right), svg_number(bottom), svg_number(left));
  for (const Tick& tick : x.ticks()) {
    grid += fmt::format("M{}V{}", numbers(tick.at_px, top), svg_number(bottom));
    frame += fmt::format("M{}v-5", numbers(tick.at_px, bottom));
    const double half = tick.is_power() ? 12 : text_width(tick.label) / 2;
    labels += tick_label(std::min(tick.at_px, kWidth - half), bottom + 17, tick, "middle");
  }
  for (const Tick& tick : y.ticks()) {
    grid += fmt::format("M{}H{}", numbers(left, tick.at_px), svg_number(right));
    frame += fmt::format("M{}h5", numbers(left, tick.at_px));
    labels += tick_label(left - 6, tick.at_px + 4, tick, "end");
  }
  for (const double at : x.minor_px()) frame += fmt::format("M{}v-3", numbers(at, bottom));
  for (const double at : y.minor_px()) frame += fmt::format("M{}h3", numbers(left, at));
  for (const Series& series : panel.series) series_text += series_svg(series, x, y);
  const double label = left - 63, middle = (top + bottom) / 2;
  return path_svg(grid, "stroke=\"#e5e7eb\" stroke-width=\"0.8\"") + series_text +
         path_svg(frame, "fill=\"none\" stroke=\"#9ca3af\" stroke-width=\"0.8\"") + labels +
         text_svg((left + right) / 2, bottom + 36, panel.x.label, "middle") +
         text_svg(label, middle, panel.y.label, "middle",
                  fmt::format(" transform=\"rotate(-90 {})\"", numbers(label, middle))) +
         text_svg(left, top - 8, panel.title, "start", kTitleInk) + key_svg(panel, right, top - 8);
}

}  // namespace

std::string draw_svg(const Plot& plot) {
  const int count = static_cast<int>(plot.panels.size()), columns = std::clamp(plot.columns, 1, 6);
  const double cell = kWidth / columns, height = std::max(plot.panel_height, kAbove + kBottom + 60);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"{2}\" fill=\"#374151\">\n",
      kWidth, height * std::max(1, (count + columns - 1) / columns), kFontPx);
  for (int i = 0; i < count; ++i) {
    const int row = i / columns;
    const double x = cell * (i % columns), y = height * row;
    svg += panel_svg(plot.panels[static_cast<std::size_t>(i)], x + kLeft, x + cell - kRight, y + kAbove,
                     y + height - kBottom);
  }
  return svg + "</svg>";
}

}  // namespace prism::report
