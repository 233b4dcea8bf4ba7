// SPDX-License-Identifier: MIT
#include "tools/prismcal/document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "base/escape.hpp"

namespace prism::report {
namespace {

Cell number_cell(std::optional<double> value, std::string text, Emphasis emphasis) {
  if (!value || !std::isfinite(*value)) return {kNothing, Emphasis::kMuted};
  return {std::move(text), value, emphasis};
}

/// The part of `parts` equal parts of a range that holds a value.
std::size_t part_of(const Range& range, double value, std::size_t parts) {
  const double share = range.high > range.low ? (value - range.low) / (range.high - range.low) : 0;
  return std::min(parts - 1, static_cast<std::size_t>(share * static_cast<double>(parts)));
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
    Range range;
  };
  std::vector<Interval> intervals(kIntervals);
  const Range range = Range::of(series.x);
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (!std::isfinite(series.x[i])) continue;
    Interval& interval = intervals[part_of(range, series.x[i], kIntervals)];
    ++interval.points;
    interval.x += series.x[i];
    if (!std::isfinite(series.y[i])) continue;
    ++interval.known;
    interval.y += series.y[i];
    interval.range.add(series.y[i]);
  }
  Series band{"", series.ink, SeriesStyle::kBand}, line{series.name, series.ink, series.form};
  for (const Interval& interval : intervals) {
    if (interval.points == 0) continue;
    const bool known = interval.known > 0;
    const double x = rounded(interval.x / static_cast<double>(interval.points)), gap = NAN;
    band.x.push_back(x);
    band.y.push_back(known ? rounded(interval.range.low) : gap);
    band.high.push_back(known ? rounded(interval.range.high) : gap);
    line.x.push_back(x);
    line.y.push_back(known ? rounded(interval.y / static_cast<double>(interval.known)) : gap);
  }
  out.push_back(std::move(band));
  out.push_back(std::move(line));
}

/// The first point of each cell of the finest grid that has few enough.
Series thinned(const Series& series) {
  const Range across = Range::of(series.x), up = Range::of(series.y);
  Series few = series;
  for (std::size_t cells = 128; cells > 1; cells = cells * 3 / 4) {
    std::set<std::pair<std::size_t, std::size_t>> taken;
    few.x.clear(), few.y.clear();
    for (std::size_t i = 0; i < series.x.size() && few.x.size() <= kMostPoints; ++i) {
      if (!std::isfinite(series.x[i]) || !std::isfinite(series.y[i])) continue;
      if (!taken.emplace(part_of(across, series.x[i], cells), part_of(up, series.y[i], cells)).second) continue;
      few.x.push_back(rounded(series.x[i]));
      few.y.push_back(rounded(series.y[i]));
    }
    if (few.x.size() <= kMostPoints) break;
  }
  return few;
}

void reduce(Figure& figure) {
  bool any = false;
  for (Panel& panel : figure.plot.panels) {
    std::vector<Series> all;
    for (Series& series : panel.series) {
      const bool points = series.form == SeriesStyle::kPoints || series.form == SeriesStyle::kOpenPoints;
      const bool longer = std::min(series.x.size(), series.y.size()) > kLongSeries;
      const bool line = series.form == SeriesStyle::kLine && std::is_sorted(series.x.begin(), series.x.end());
      any = any || (longer && (line || points));
      if (longer && line)
        reduce_line(series, all);
      else
        all.push_back(longer && points ? thinned(series) : std::move(series));
    }
    panel.series = std::move(all);
  }
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

Block reduced(Block block) {
  if (auto* const table = std::get_if<Table>(&block)) reduce(*table);
  if (auto* const figure = std::get_if<Figure>(&block)) reduce(*figure);
  return block;
}

Report reduced(Report report) {
  for (Section& section : report.sections) {
    for (Block& block : section.blocks) block = reduced(std::move(block));
  }
  return report;
}

namespace {

using Json = nlohmann::ordered_json;

template <class Wanted, class Visit>
void each(const Report& report, const Visit& visit) {
  for (const Section& section : report.sections) {
    for (const Block& block : section.blocks) {
      if (const auto* wanted = std::get_if<Wanted>(&block)) visit(*wanted);
    }
  }
}

void append_row(std::string& text, const std::vector<std::string>& fields) {
  for (std::size_t i = 0; i < fields.size(); ++i) text += (i > 0 ? "," : "") + csv_cell(fields[i]);
  text += '\n';
}

Json table_json(const Table& table) {
  Json columns = Json::array(), rows = Json::array();
  for (const Column& column : table.columns) columns.push_back({{"name", column.name}, {"unit", column.unit}});
  for (const auto& row : table.rows) {
    Json cells = Json::array();
    for (const Cell& cell : row) {
      Json field = {{"text", cell.text}};
      if (cell.value) field["value"] = *cell.value;
      if (!cell.link.empty()) field["link"] = cell.link;
      cells.push_back(std::move(field));
    }
    rows.push_back(std::move(cells));
  }
  Json json = {{"title", table.title}, {"caption", table.caption}, {"columns", columns}, {"rows", rows}};
  if (!table.meaning.empty()) json["meaning"] = table.meaning;
  return json;
}

Json numbers_json(const std::vector<double>& values) {
  Json json = Json::array();
  for (const double value : values) json.push_back(std::isfinite(value) ? Json(value) : Json());
  return json;
}

Json figure_json(const Figure& figure) {
  Json panels = Json::array();
  for (const Panel& panel : figure.plot.panels) {
    Json curves = Json::array();
    for (const Series& series : panel.series) {
      Json curve = {{"name", series.name}, {"x", numbers_json(series.x)}, {"y", numbers_json(series.y)}};
      if (!series.high.empty()) curve["high"] = numbers_json(series.high);
      curves.push_back(std::move(curve));
    }
    panels.push_back({{"title", panel.title}, {"x", panel.x.label}, {"y", panel.y.label}, {"curves", curves}});
  }
  Json json = {{"title", figure.title}, {"caption", figure.caption}, {"panels", panels}};
  if (!figure.meaning.empty()) json["meaning"] = figure.meaning;
  return json;
}

/// Number of UTF-8 characters: bytes that are not continuation bytes.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

}  // namespace

std::vector<std::pair<std::string, std::string>> csv_files(const Report& report) {
  std::vector<std::pair<std::string, std::string>> files;
  each<Table>(report, [&files](const Table& table) {
    std::string text;
    std::vector<std::string> fields;
    for (const Column& column : table.columns)
      fields.push_back(column.unit.empty() ? column.name : column.name + " [" + column.unit + "]");
    append_row(text, fields);
    for (const auto& row : table.rows) {
      fields.clear();
      for (const Cell& cell : row) fields.push_back(cell.text == kNothing ? "" : cell.text);
      append_row(text, fields);
    }
    files.emplace_back(table.id + ".csv", std::move(text));
  });
  return files;
}

std::string json_text(const Report& report) {
  Json cover = Json::object(), facts = Json::object(), tables = Json::object(), figures = Json::object();
  for (const auto& [name, value] : report.cover) cover[name] = value;
  for (const auto& [name, value] :
       report.facts)  // facts with the same name, e.g. the files of a folder, form one member
    facts[name] = facts.contains(name) ? facts[name].get<std::string>() + "; " + value : value;
  each<Table>(report, [&tables](const Table& table) { tables[table.id] = table_json(table); });
  each<Figure>(report, [&figures](const Figure& figure) { figures[figure.id] = figure_json(figure); });
  Json json = Json::object();
  if (!report.warning.empty()) json["warning"] = report.warning;
  json.update({{"format", "prism-report"},
               {"version", 1},
               {"title", report.title},
               {"simulated", report.simulated},
               {"tool", report.tool},
               {"cover", cover},
               {"facts", facts},
               {"tables", tables},
               {"figures", figures}});
  if (cover.empty()) json.erase("cover");
  return prism::json_text(json, 1) + "\n";
}

std::string plain_text(const Table& table) {
  std::vector<std::vector<std::string>> lines(2);  // names and units; the rows follow
  for (const Column& column : table.columns) {
    lines[0].push_back(printable(column.name));
    lines[1].push_back(printable(column.unit));
  }
  for (const auto& row : table.rows) {
    lines.emplace_back();
    for (const Cell& cell : row) lines.back().push_back(printable(cell.text));
  }
  std::vector<std::size_t> widths(table.columns.size());
  for (const auto& line : lines) {
    for (std::size_t i = 0; i < widths.size(); ++i) widths[i] = std::max(widths[i], width_of(line[i]));
  }
  std::string text = printable(table.title) + "\n";
  for (const auto& fields : lines) {
    std::string line;
    for (std::size_t i = 0; i < widths.size(); ++i) {
      const std::string space(widths[i] - width_of(fields[i]), ' ');
      line += (table.columns[i].number ? space + fields[i] : fields[i] + space) + "  ";
    }
    line.erase(line.find_last_not_of(' ') + 1);
    if (!line.empty()) text += line + "\n";  // no column has a unit
  }
  if (!table.caption.empty()) text += printable(table.caption) + "\n";
  return text + (table.meaning.empty() ? "" : "→ " + printable(table.meaning) + "\n");
}

std::string plain_text(const Report& report) {
  std::string text = report.warning.empty() ? "" : printable(report.warning) + "\n\n";
  for (const Section& section : report.sections) {
    for (const Block& block : section.blocks) {
      if (const auto* table = std::get_if<Table>(&block)) text += plain_text(*table) + "\n";
      if (const auto* paragraph = std::get_if<Paragraph>(&block)) text += printable(paragraph->text) + "\n\n";
      if (const auto* figure = std::get_if<Figure>(&block); figure && !figure->meaning.empty())
        text += printable(figure->title) + "\n→ " + printable(figure->meaning) + "\n\n";
    }
  }
  return text;
}

}  // namespace prism::report
