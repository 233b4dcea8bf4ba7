// SPDX-License-Identifier: MIT
// Values of prismd's responses as text, and output without control characters that act on a terminal.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/result.hpp"

namespace prism::prismctl {

/// Returns a member; null if it is missing or `object` is not an object.
inline const nlohmann::json& at(const nlohmann::json& object, std::string_view key) { return member(object, key); }

/// Returns the text, made printable (escape.hpp), or `otherwise` if it is empty or not a string. Use it for every text
/// of a response that is shown, and printable() for names of members.
std::string text_of(const nlohmann::json& value, const std::string& otherwise = "-");

/// Returns a number with `decimals` and its unit, or "-" if it is null.
std::string value_text(const nlohmann::json& value, int decimals, const char* unit = "");

/// Returns a count; "-" if it is missing.
std::string count_text(const nlohmann::json& value);

/// Returns the members of `object` that are counts in a format with a {} for each.
template <class... Keys>
std::string counts_text(std::string_view format, const nlohmann::json& object, Keys... keys) {
  return fmt::format(fmt::runtime(format), count_text(at(object, keys))...);
}

/// Returns the integer part of a number, limited to ±9e15; `otherwise` if the value is not a number.
std::int64_t integer_of(const nlohmann::json& value, std::int64_t otherwise = 0);

/// A time span in its two largest units: "0.4 s", "15 s", "2 min 5 s", "3 h 20 min", "4 d 2 h".
std::string span_text(double seconds);

/// "last data 0.4 s ago", or "no data yet" if `age_s` is null.
std::string age_text(const nlohmann::json& age_s);

/// Returns the integer part of a number of seconds, 0 to 2^20; `otherwise` if the value is not a number.
int seconds_of(const nlohmann::json& value, int otherwise);

/// Length of the window of the long means, s.
int window_length_s(const nlohmann::json& answer);

/// A line of a view: the label in 12 columns, and the value or the arguments in a format.
inline std::string labelled(std::string_view label, std::string_view value) {
  return fmt::format("{:<12} {}\n", label, value);
}
template <class... Args>
std::string labelled(std::string_view label, fmt::format_string<Args...> format, Args&&... args) {
  return labelled(label, fmt::format(format, std::forward<Args>(args)...));
}

/// UTC of seconds since 1970, or "-" if it is not a number.
std::string utc_of(const nlohmann::json& seconds);

/// Prints a value (any nlohmann type) as JSON; characters that are not printable are written as u-escapes (four
/// hexadecimal digits).
template <class AnyJson>
void print_json(const AnyJson& value, int indent = -1) {
  fmt::print("{}\n", printable_json(json_text(value, indent)));
}

/// Prints one or more lines.
inline void print_text(std::string_view text) { fmt::print("{}", printable_lines(text)); }

/// Prints the error; returns exit code 1.
int fail(const Error& error);

}  // namespace prism::prismctl
