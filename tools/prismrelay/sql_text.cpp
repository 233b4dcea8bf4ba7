// SPDX-License-Identifier: MIT
#include "tools/prismrelay/sql_text.hpp"

#include <nlohmann/json.hpp>

#include "base/escape.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;

constexpr std::string_view kReplacement = "\xef\xbf\xbd";  // U+FFFD

json storable(const json& value) {
  if (value.is_string()) return database_text(value.get_ref<const std::string&>());
  if (!value.is_structured()) return value;
  json result = value.is_object() ? json::object() : json::array();
  if (value.is_object()) {
    for (const auto& [name, element] : value.items()) result[database_text(name)] = storable(element);
  } else {
    for (const json& element : value) result.push_back(storable(element));
  }
  return result;
}

}  // namespace

std::string database_text(std::string_view text) {
  std::string valid = valid_utf8(text);
  if (valid.find('\0') == std::string::npos) return valid;
  std::string result;
  for (const char c : valid) result += c == '\0' ? kReplacement : std::string_view(&c, 1);
  return result;
}

std::string jsonb_text(const json& value) { return json_text(storable(value)); }

void append_quoted(std::string& csv, std::string_view text, std::size_t max) {
  csv += '"';
  for (const char c : database_text(utf8_prefix(text, max))) {
    if (c == '"') csv += '"';
    csv += c;
  }
  csv += '"';
}

}  // namespace prism::prismrelay
