// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/text_forms.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace prism::report {
namespace {

using Json = nlohmann::ordered_json;

std::string csv_field(const std::string& text) {
  if (text == kNothing) return {};
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

std::string column_name(const Column& column) {
  return column.unit.empty() ? column.name : column.name + " [" + column.unit + "]";
}

template <class Visit>
void each_table(const Report& report, const Visit& visit) {
  for (const Section& section : report.sections) {
    for (const Block& block : section.blocks) {
      if (const auto* table = std::get_if<Table>(&block)) visit(*table);
    }
  }
}

Json table_json(const Table& table) {
  Json columns = Json::array(), rows = Json::array();
  for (const Column& column : table.columns) columns.push_back({{"name", column.name}, {"unit", column.unit}});
  for (const auto& row : table.rows) {
    Json cells = Json::array();
    for (const Cell& cell : row) {
      Json field = {{"text", cell.text}};
      if (cell.value) field["value"] = *cell.value;
      cells.push_back(std::move(field));
    }
    rows.push_back(std::move(cells));
  }
  return {{"title", table.title}, {"caption", table.caption}, {"columns", columns}, {"rows", rows}};
}

/// Characters of UTF-8: bytes that do not continue one.
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
  for (const auto& [name, value] : report.facts) text += "# fact," + csv_field(name) + "," + csv_field(value) + "\n";
  each_table(report, [&text](const Table& table) {
    text += "\n# table," + table.id + "," + csv_field(table.title) + "\n";
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
      text += (i > 0 ? "," : "") + csv_field(column_name(table.columns[i]));
    }
    text += '\n';
    for (const auto& row : table.rows) {
      for (std::size_t i = 0; i < row.size(); ++i) text += (i > 0 ? "," : "") + csv_field(row[i].text);
      text += '\n';
    }
  });
  return text;
}

std::string json_text(const Report& report) {
  Json facts = Json::object(), tables = Json::object();
  for (const auto& [name, value] : report.facts) facts[name] = value;
  each_table(report, [&tables](const Table& table) { tables[table.id] = table_json(table); });
  Json json = Json::object();
  if (!report.warning.empty()) json["warning"] = report.warning;
  json.update({{"format", "prism-report"},
               {"version", 1},
               {"title", report.title},
               {"simulated", report.simulated},
               {"tool", report.tool},
               {"facts", facts},
               {"tables", tables}});
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string plain_text(const Table& table) {
  std::vector<std::size_t> widths;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    std::size_t width = std::max(width_of(table.columns[i].name), width_of(table.columns[i].unit));
    for (const auto& row : table.rows) width = std::max(width, width_of(row[i].text));
    widths.push_back(width);
  }
  std::string text = table.title + "\n";
  for (const bool units : {false, true}) {
    std::string line;
    for (std::size_t i = 0; i < widths.size(); ++i) {
      const Column& column = table.columns[i];
      append_padded(line, units ? column.unit : column.name, widths[i], column.number);
      line += "  ";
    }
    append_line(text, line);
  }
  for (const auto& row : table.rows) {
    std::string line;
    for (std::size_t i = 0; i < widths.size(); ++i) {
      append_padded(line, row[i].text, widths[i], table.columns[i].number);
      line += "  ";
    }
    append_line(text, line);
  }
  return text + (table.caption.empty() ? "" : table.caption + "\n");
}

}  // namespace prism::report
