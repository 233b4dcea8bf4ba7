// SPDX-License-Identifier: MIT
// Reads members of external JSON without exceptions, whatever their type is.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace prism {

/// A member; null if it is absent or `object` is not an object.
inline const nlohmann::json& member(const nlohmann::json& object, std::string_view key) {
  static const nlohmann::json kNull;
  if (!object.is_object()) return kNull;
  const auto found = object.find(key);
  return found == object.end() ? kNull : *found;
}

/// A string member; `otherwise` if it is missing or not a string.
inline std::string text_member(const nlohmann::json& object, std::string_view key, std::string otherwise = "") {
  const nlohmann::json& value = member(object, key);
  return value.is_string() ? value.get<std::string>() : std::move(otherwise);
}

/// A number member; `otherwise` if it is missing or not a number.
inline double number_member(const nlohmann::json& object, std::string_view key, double otherwise = 0) {
  const nlohmann::json& value = member(object, key);
  return value.is_number() ? value.get<double>() : otherwise;
}

/// A count member; 0 if it is missing or not an integer of at least 0.
inline std::uint64_t count_member(const nlohmann::json& object, std::string_view key) {
  const nlohmann::json& value = member(object, key);
  return value.is_number_unsigned() ? value.get<std::uint64_t>() : 0;
}

/// True only if the member is true.
inline bool flag_member(const nlohmann::json& object, std::string_view key) {
  const nlohmann::json& value = member(object, key);
  return value.is_boolean() && value.get<bool>();
}

/// Parses JSON text from a socket, nested at most `max_depth` levels: deeper values would exhaust the stack when copied
/// or written. Returns nullopt if the text is invalid or deeper.
std::optional<nlohmann::json> parse_json_line(std::string_view line, int max_depth = 64);

}  // namespace prism
