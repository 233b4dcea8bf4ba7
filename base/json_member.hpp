// SPDX-License-Identifier: MIT
// Reads members of external JSON without exceptions, whatever their type is.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace prism {

/// A member; null if it is absent or `object` is not an object.
const nlohmann::json& member(const nlohmann::json& object, std::string_view key);

/// A string member; `otherwise` if it is missing or not a string.
std::string text_member(const nlohmann::json& object, std::string_view key, std::string otherwise = "");

/// A number member; `otherwise` if it is missing or not a number.
double number_member(const nlohmann::json& object, std::string_view key, double otherwise = 0);

/// A count member; 0 if it is missing or not an integer of at least 0.
std::uint64_t count_member(const nlohmann::json& object, std::string_view key);

/// True only if the member is true.
bool flag_member(const nlohmann::json& object, std::string_view key);

inline constexpr int kMostJsonLevels = 64;

/// Parses JSON text from a socket, nested at most `max_depth` levels: deeper values would exhaust the stack when copied
/// or written. Returns nullopt if the text is invalid or deeper.
std::optional<nlohmann::json> parse_json_line(std::string_view line, int max_depth = kMostJsonLevels);

}  // namespace prism
