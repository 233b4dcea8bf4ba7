// SPDX-License-Identifier: MIT
#include "drivers/wire/description/column_choice.hpp"

#include <algorithm>

#include "base/json_document.hpp"

namespace prism::wire {
namespace {

bool is_text_line(const Json& description) {
  if (!description.is_object() || description.contains("gyro") || !description.contains("kinds")) return false;
  const Json& kinds = description["kinds"];
  return kinds.is_array() && kinds.size() == 1 && kinds[0].is_object() && kinds[0].contains("text") &&
         kinds[0]["text"].is_object() && kinds[0].contains("length") && kinds[0]["length"].is_object();
}

/// Template of an encoder: the chosen columns, and a 0 in those between them.
std::string printed(const TextColumns& choice) {
  int last = 0;
  for (const TextColumn& column : choice.columns) last = std::max(last, column.column);
  std::string text;
  for (int i = 0; i <= last; ++i) {
    const auto named = std::find_if(choice.columns.begin(), choice.columns.end(),
                                    [i](const TextColumn& column) { return column.column == i; });
    if (i > 0) text += choice.separators.front();
    text += named == choice.columns.end() ? "0" : "{" + named->sensor.name + ":.4f}";
  }
  return text;
}

}  // namespace

Result<void> choose_columns(Json& description, const std::string& where, const TextColumns& choice) {
  if (choice.columns.empty()) return {};
  if (!is_text_line(description))
    return make_error(where, "does not describe text lines without a gyro, as required by \"columns\"");
  Json& kind = description["kinds"][0];
  const char* end = choice.ends_with_cr ? "0D" : "0A";
  kind["after"] = end;
  kind["length"]["terminator"] = end;
  // The CR of a CR LF ends the last column.
  const bool blanks = choice.separators.find_first_not_of(" \t") == std::string::npos;
  kind["text"]["separators"] = choice.separators + (choice.ends_with_cr ? "\n" : "\r");
  kind["text"]["collapse"] = blanks;
  kind["text"]["decimal_comma"] = choice.decimal_comma;
  kind["text"]["write"] = printed(choice);
  kind["fields"] = Json::object();
  description["sensors"] = Json::object();
  for (const TextColumn& column : choice.columns) {
    const std::string& name = column.sensor.name;
    Json& field = kind["fields"][name];
    field = {{"column", column.column}, {"type", "decimal"}, {"unit", column.sensor.unit}};
    if (column.min > -1e300) field["min"] = column.min;
    if (column.max < 1e300) field["max"] = column.max;
    description["sensors"][name] = {{"field", name}, {"unit", column.sensor.unit}};
  }
  description["vectors"] = Json::array();  // they belong to other columns
  return {};
}

}  // namespace prism::wire
