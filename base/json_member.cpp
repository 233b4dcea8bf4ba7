// SPDX-License-Identifier: MIT
#include "base/json_member.hpp"

#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>

namespace prism {
namespace {

/// Depth of the brackets outside of strings. The parser reports invalid text.
bool nests_too_deep(std::string_view text, int max_depth) {
  int depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_text && c == '\\') {
      ++i;
    } else if (c == '"') {
      in_text = !in_text;
    } else if (!in_text && (c == '{' || c == '[')) {
      if (++depth > max_depth) return true;
    } else if (!in_text && (c == '}' || c == ']')) {
      --depth;
    }
  }
  return false;
}

}  // namespace

const nlohmann::json& member(const nlohmann::json& object, std::string_view key) {
  static const nlohmann::json kNull;
  const auto found = object.find(key);  // of another type: the end
  return found == object.end() ? kNull : *found;
}

std::string text_member(const nlohmann::json& object, std::string_view key, std::string otherwise) {
  const nlohmann::json& value = member(object, key);
  return value.is_string() ? value.get<std::string>() : std::move(otherwise);
}

double number_member(const nlohmann::json& object, std::string_view key, double otherwise) {
  const nlohmann::json& value = member(object, key);
  return value.is_number() ? value.get<double>() : otherwise;
}

std::uint64_t count_member(const nlohmann::json& object, std::string_view key) {
  const nlohmann::json& value = member(object, key);
  return value.is_number_unsigned() ? value.get<std::uint64_t>() : 0;
}

bool flag_member(const nlohmann::json& object, std::string_view key) {
  const nlohmann::json& value = member(object, key);
  return value.is_boolean() && value.get<bool>();
}

std::optional<nlohmann::json> parse_json_line(std::string_view line, int max_depth) {
  if (nests_too_deep(line, max_depth)) return std::nullopt;
  nlohmann::json value = nlohmann::json::parse(line, nullptr, false);
  if (value.is_discarded()) return std::nullopt;
  return value;
}

}  // namespace prism
