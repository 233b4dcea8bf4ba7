// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/machine_text.hpp"

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

}  // namespace

std::string csv_text(const Report& report) {
  std::string text = "# report," + csv_field(report.title) + (report.simulated ? ",SIMULATED" : "") + "\n";
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
  const Json json = {
      {"format", "prism-report"}, {"version", 1},   {"title", report.title}, {"simulated", report.simulated},
      {"tool", report.tool},      {"facts", facts}, {"tables", tables}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace prism::report
