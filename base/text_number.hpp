// SPDX-License-Identifier: MIT
// Numbers as text on the hot path: no locale, no allocation except the string's own.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace prism {

/// Returns the finite number that is all of `text`, without blanks and '+'; nullopt for any other text and outside the
/// range of the type.
template <class Number>
std::optional<Number> parse_number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(value)) return std::nullopt;  // from_chars accepts "inf" and "nan"
  }
  return value;
}

/// Reads the number of a text as put_fixed() writes it with `decimals` (1 to 8) places and up to 15 digits; returns
/// false for any other text. `before`: bytes before `text` that may be read. The value is that of from_chars(), which
/// takes several times as long.
bool parse_fixed(std::string_view text, std::size_t before, int decimals, double& value);
/// Returns false for a text that parse_fixed() cannot read, in half of its time; also for some of those that it can.
bool is_fixed(std::string_view text, std::size_t before, int decimals);

/// Maximum length that put_fixed and put_integer write.
inline constexpr int kNumberChars = 32;

/// Writes at `at`, which has space for kNumberChars; returns the end of the text.
char* put_fixed(char* at, double value, int decimals);
char* put_integer(char* at, std::int64_t value);

/// Appends `value` rounded to `decimals` (0 to 9) places, halves away from zero. Appends nothing if `value` is not
/// finite: callers write the "unknown" of their format. Outside ±9e8: shortest digits. put_fixed writes the same to a
/// caller's buffer.
void append_fixed(std::string& text, double value, int decimals);

void append_integer(std::string& text, std::int64_t value);

/// 2026-11-21T09:11:00Z for seconds since 1970 UTC (years 0000 to 9999; outside them the number itself).
std::string utc_text(std::int64_t second);

/// 2026-11-21T09:11:00.000000001Z for nanoseconds since 1970 UTC.
std::string utc_nano_text(std::int64_t time_ns);

/// The same time as utc_text in a form for file names: 20261121T091100Z.
std::string utc_file_text(std::int64_t second);

/// Reads the first 16 characters of utc_file_text (year 0000 to 9999). Returns nullopt for any other text.
std::optional<std::int64_t> parse_utc_file_text(std::string_view text);

/// Bytes in hexadecimal digits: "A5 5A" → bytes; empty if the text is anything else.
std::vector<std::uint8_t> hex_bytes(std::string_view text);

}  // namespace prism
