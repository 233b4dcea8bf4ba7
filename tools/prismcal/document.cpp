// SPDX-License-Identifier: MIT
#include "tools/prismcal/document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>

namespace prism::report {
namespace {

Cell number_cell(std::optional<double> value, std::string text, Emphasis emphasis) {
  if (!value || !std::isfinite(*value)) return {kNothing, Emphasis::kMuted};
  return {std::move(text), value, emphasis};
}

struct Extent {
  double low = HUGE_VAL, high = -HUGE_VAL;

  void add(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value), high = std::max(high, value);
  }
  /// The part of `parts` equal parts that holds a value.
  std::size_t part(double value, std::size_t parts) const {
    const double share = high > low ? (value - low) / (high - low) : 0;
    return std::min(parts - 1, static_cast<std::size_t>(share * static_cast<double>(parts)));
  }
};

Extent extent_of(const std::vector<double>& values) {
  Extent extent;
  for (const double value : values) extent.add(value);
  return extent;
}

/// Seven digits, as in the chart.
double rounded(double value) {
  if (!std::isfinite(value) || value == 0) return value;
  const double unit = std::pow(10.0, 6 - std::floor(std::log10(std::fabs(value))));
  return std::round(value * unit) / unit;
}

/// A band and a line. An interval without a known value interrupts them.
void reduce_line(const Series& series, std::vector<Series>& out) {
  struct Interval {
    std::size_t points = 0, known = 0;
    double x = 0, y = 0;
    Extent extent;
  };
  std::vector<Interval> intervals(kIntervals);
  const Extent range = extent_of(series.x);
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (!std::isfinite(series.x[i])) continue;
    Interval& interval = intervals[range.part(series.x[i], kIntervals)];
    ++interval.points;
    interval.x += series.x[i];
    if (!std::isfinite(series.y[i])) continue;
    ++interval.known;
    interval.y += series.y[i];
    interval.extent.add(series.y[i]);
  }
  Series band{"", series.ink, SeriesStyle::kBand}, line{series.name, series.ink, series.form};
  for (const Interval& interval : intervals) {
    if (interval.points == 0) continue;
    const bool known = interval.known > 0;
    const double x = rounded(interval.x / static_cast<double>(interval.points)), gap = NAN;
    band.x.push_back(x);
    band.y.push_back(known ? rounded(interval.extent.low) : gap);
    band.high.push_back(known ? rounded(interval.extent.high) : gap);
    line.x.push_back(x);
    line.y.push_back(known ? rounded(interval.y / static_cast<double>(interval.known)) : gap);
  }
  out.push_back(std::move(band));
  out.push_back(std::move(line));
}

/// The first point of each cell of the finest grid that has few enough.
Series thinned(const Series& series) {
  const Extent across = extent_of(series.x), up = extent_of(series.y);
  Series few = series;
  for (std::size_t cells = 128; cells > 1; cells = cells * 3 / 4) {
    std::set<std::pair<std::size_t, std::size_t>> taken;
    few.x.clear(), few.y.clear();
    for (std::size_t i = 0; i < series.x.size() && few.x.size() <= kMostPoints; ++i) {
      if (!std::isfinite(series.x[i]) || !std::isfinite(series.y[i])) continue;
      if (!taken.emplace(across.part(series.x[i], cells), up.part(series.y[i], cells)).second) continue;
      few.x.push_back(rounded(series.x[i]));
      few.y.push_back(rounded(series.y[i]));
    }
    if (few.x.size() <= kMostPoints) break;
  }
  return few;
}

/// Returns true if a series was reduced.
bool reduce(Panel& panel) {
  bool any = false;
  std::vector<Series> all;
  for (Series& series : panel.series) {
    const bool points = series.form == SeriesStyle::kPoints || series.form == SeriesStyle::kOpenPoints;
    const bool longer = std::min(series.x.size(), series.y.size()) > kLongSeries;
    if (longer && series.form == SeriesStyle::kLine && std::is_sorted(series.x.begin(), series.x.end())) {
      reduce_line(series, all);
    } else if (longer && points) {
      all.push_back(thinned(series));
    } else {
      all.push_back(std::move(series));
      continue;
    }
    any = true;
  }
  panel.series = std::move(all);
  return any;
}

void reduce(Figure& figure) {
  bool any = false;
  for (Panel& panel : figure.plot.panels) any = reduce(panel) || any;
  if (any)
    figure.caption += fmt::format("{}Mean, and minimum to maximum, of {} intervals; fewer points; all: --all-blocks.",
                                  figure.caption.empty() ? "" : " ", kIntervals);
}

/// Adds the rows with the smallest and with the largest value of each column.
void add_extremes(const Table& table, std::set<std::size_t>& rows) {
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    std::optional<std::size_t> smallest, largest;
    const auto value = [&](std::size_t row) { return *table.rows[row][c].value; };
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
      if (c >= table.rows[i].size() || !table.rows[i][c].value) continue;
      if (!smallest || value(i) < value(*smallest)) smallest = i;
      if (!largest || value(i) > value(*largest)) largest = i;
    }
    if (smallest) rows.insert({*smallest, *largest});
  }
}

void reduce(Table& table) {
  if (table.rows.size() <= kMostRows) return;
  std::set<std::size_t> kept;
  add_extremes(table, kept);
  const std::size_t others = kMostRows - std::min(kMostRows, kept.size());
  for (std::size_t i = 0; i < others; ++i) kept.insert(i * table.rows.size() / others);
  table.caption += fmt::format(
      "{}{} of {} rows: those with the smallest and largest values, and others at equal distances; all: --all-blocks.",
      table.caption.empty() ? "" : " ", kept.size(), table.rows.size());
  std::vector<std::vector<Cell>> rows;
  for (const std::size_t row : kept) rows.push_back(std::move(table.rows[row]));
  table.rows = std::move(rows);
}

void reduce(Paragraph&) {}

}  // namespace

Column::Column(std::string text) : name(std::move(text)), number(!name.ends_with(':')) {
  if (!number) name.pop_back();
  const std::size_t bracket = name.find(" [");
  if (bracket == std::string::npos) return;
  unit = name.substr(bracket + 2, name.size() - bracket - 3);
  name.resize(bracket);
}

std::vector<Column> columns(const char* text) {
  constexpr std::string_view kBetween = " | ";
  std::vector<Column> all;
  for (std::string_view left = text;;) {
    const std::size_t end = left.find(kBetween);
    all.emplace_back(std::string(left.substr(0, end)));
    if (end == std::string_view::npos) return all;
    left.remove_prefix(end + kBetween.size());
  }
}

Cell count_cell(std::size_t count) { return {fmt::format("{}", count), static_cast<double>(count)}; }

Cell fixed_cell(std::optional<double> value, int decimals, Emphasis emphasis) {
  std::string text = fmt::format("{:.{}f}", value.value_or(0), decimals);
  if (text.find_first_not_of("-0.") == std::string::npos && text[0] == '-') text.erase(0, 1);  // no −0.000
  return number_cell(value, std::move(text), emphasis);
}

Cell general_cell(std::optional<double> value, int digits, Emphasis emphasis) {
  return number_cell(value, fmt::format("{:.{}g}", value.value_or(0), digits), emphasis);
}

Cell percent_cell(std::optional<double> share, Emphasis emphasis) {
  return fixed_cell(share ? std::optional(100 * *share) : std::nullopt, 2, emphasis);
}

std::string id_or_number(const std::string& id, const char* kind, int number) {
  const bool plain = !id.empty() && id.size() <= 80 &&
                     id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string::npos;
  return plain ? id : fmt::format("{}-{}", kind, number);
}

Block reduced(Block block) {
  std::visit([](auto& part) { reduce(part); }, block);
  return block;
}

Report reduced(Report report) {
  for (Section& section : report.sections) {
    for (Block& block : section.blocks) block = reduced(std::move(block));
  }
  return report;
}

}  // namespace prism::report
