// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "tools/prismcal/document.hpp"

namespace prism::report {
namespace {

using Json = nlohmann::ordered_json;

std::string csv_field(const std::string& text) { return text == kNothing ? std::string() : csv_cell(text); }

std::string column_name(const Column& column) {
  return column.unit.empty() ? column.name : column.name + " [" + column.unit + "]";
}

template <class Wanted, class Visit>
void each(const Report& report, const Visit& visit) {
  for (const Section& section : report.sections) {
    for (const Block& block : section.blocks) {
      if (const auto* wanted = std::get_if<Wanted>(&block)) visit(*wanted);
    }
  }
}

void append_row(std::string& text, const std::vector<std::string>& fields) {
  for (std::size_t i = 0; i < fields.size(); ++i) text += (i > 0 ? "," : "") + csv_field(fields[i]);
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
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

void append_padded(std::string& line, const std::string& text, std::size_t width, bool right) {
  const std::string space(width - std::min(width, width_of(text)), ' ');
  line += right ? space + text : text + space;
}

void append_line(std::string& text, std::string line) {
  while (!line.empty() && line.back() == ' ') line.pop_back();
  text += line + "\n";
}

}  // namespace

std::string csv_text(const Report& report) {
  std::string text = report.warning.empty() ? "" : "# warning," + csv_field(report.warning) + "\n";
  text += "# report," + csv_field(report.title) + (report.simulated ? ",SIMULATED" : "") + "\n";
  text += "# tool," + csv_field(report.tool) + "\n";
  for (const auto& [name, value] : report.cover) text += "# cover," + csv_field(name) + "," + csv_field(value) + "\n";
  for (const auto& [name, value] : report.facts) text += "# fact," + csv_field(name) + "," + csv_field(value) + "\n";
  each<Table>(report, [&text](const Table& table) {
    text += "\n# table," + csv_field(table.id) + "," + csv_field(table.title) + "\n" + csv_text(table);
  });
  return text;
}

std::string csv_text(const Table& table) {
  std::string text;
  std::vector<std::string> fields;
  for (const Column& column : table.columns) fields.push_back(column_name(column));
  append_row(text, fields);
  for (const auto& row : table.rows) {
    fields.clear();
    for (const Cell& cell : row) fields.push_back(cell.text);
    append_row(text, fields);
  }
  return text;
}

std::vector<std::pair<std::string, std::string>> csv_files(const Report& report) {
  std::vector<std::pair<std::string, std::string>> files;
  each<Table>(report, [&files](const Table& table) {
    const int number = static_cast<int>(files.size()) + 1;
    files.emplace_back(id_or_number(table.id, "table", number) + ".csv", csv_text(table));
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
      append_padded(line, fields[i], widths[i], table.columns[i].number);
      line += "  ";
    }
    append_line(text, line);
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
