// SPDX-License-Identifier: MIT
#include "compensation/log_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/text_number.hpp"

namespace prism::compensation {
namespace {

constexpr std::int64_t kFarthestSecond = 9'223'372'036;  // the range of std::int64_t nanoseconds

// With one digit in the last column, a truncated row always has too few columns or an empty last one.
static_assert(kLogColumns.back().name == "partial" && kLogColumns.back().type == ColumnType::kFlag);
static_assert(kLogColumns[kColumnsOfFormat1 - 1].name == "quality");
static_assert(kJsonColumns.front() == column_index("time_s"));
static_assert(
    [] {
      for (std::size_t i = 0; i < kJsonColumns.size(); ++i) {
        if (kLogColumns[kJsonColumns[i]].json != static_cast<int>(i) + 1) return false;
      }
      return true;
    }(),
    "each position in JSON is used once, from 1 on");

/// The number of a field of digits and one point, as logs have them: the quotient of two integers below 2^53 is rounded
/// once, as from_chars() does, and takes a third of its time. Returns false for other fields.
bool parse_decimals(std::string_view field, double& value) {
  constexpr std::array kPowers = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const bool negative = field.starts_with('-');
  if (negative) field.remove_prefix(1);
  if (field.size() < 3 || field.size() > 16 || field.front() == '.' || field.back() == '.') return false;
  std::uint64_t digits = 0;
  std::size_t point = 0;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const auto digit = static_cast<unsigned>(field[i] - '0');
    if (digit < 10) {
      digits = 10 * digits + digit;
    } else if (field[i] == '.' && point == 0) {
      point = i;
    } else {
      return false;
    }
  }
  if (point == 0) return false;
  const double number = static_cast<double>(digits) / kPowers[field.size() - 1 - point];
  value = negative ? -number : number;
  return true;
}

template <class Number>
bool take_number(std::string_view field, Number& value) {
  const std::optional<Number> number = parse_number<Number>(field);
  if (number) value = *number;
  return number.has_value();
}

}  // namespace

namespace column {

void append(std::string& text, double value, int decimals) { append_fixed(text, value, decimals); }

void append(std::string& text, std::uint32_t value) { append_integer(text, value); }

// An empty field is an unknown quantity. A log contains no "nan" or "inf".
bool parse(std::string_view field, double& value) {
  return field.empty() || parse_decimals(field, value) || take_number(field, value);
}

bool parse(std::string_view field, std::uint32_t& value) { return take_number(field, value); }

void append_utc(std::string& text, const CompensatedWindow& row) {
  text += utc_text(row.window.second_mean.second + 1);
}

void append_second(std::string& text, const CompensatedWindow& row) {
  append_integer(text, row.window.second_mean.second + 1);
}

bool parse_second(std::string_view field, CompensatedWindow& row) {
  std::int64_t end_s = 0;
  const bool good = take_number(field, end_s) && end_s >= -kFarthestSecond && end_s <= kFarthestSecond;
  if (good) row.window.second_mean.second = end_s - 1;
  return good;
}

void append_quality(std::string& text, const CompensatedWindow& row) { text += quality_text(row.correction.quality); }

bool parse_quality(std::string_view field, CompensatedWindow& row) {
  row.correction.quality = kGood;
  if (field == "good") return true;
  row.correction.quality = compensation::parse_quality(std::string(field));
  // The log does not state which quantity was implausible, so the reader uses none of this second.
  if (row.correction.quality & kImplausible)
    row.window.second_mean.implausible = row.window.second_mean.all_implausible = {true, true, true};
  row.window.second_mean.clocks_differ = (row.correction.quality & kClocksDiffer) != 0;
  // A truncated or unknown name must not read as "good".
  return quality_text(row.correction.quality) == field;
}

void append_arrival(std::string& text, const CompensatedWindow& row) {
  const std::int64_t whole_ms = row.window.second_mean.arrival_ns / 1'000'000;
  if (whole_ms > 0) text += fmt::format("{}.{:03}", whole_ms / 1000, whole_ms % 1000);
}

bool parse_arrival(std::string_view field, CompensatedWindow& row) {
  double arrival_s = 0;
  if (!parse(field, arrival_s) || !(arrival_s >= 0 && arrival_s <= static_cast<double>(kFarthestSecond))) return false;
  row.window.second_mean.arrival_ns = std::llround(arrival_s * 1e3) * 1'000'000;
  return true;
}

void append_partial(std::string& text, const CompensatedWindow& row) {
  text += row.window.second_mean.partial ? '1' : '0';
}

bool parse_partial(std::string_view field, CompensatedWindow& row) {
  row.window.second_mean.partial = field == "1";
  return field == "0" || field == "1";
}

}  // namespace column
}  // namespace prism::compensation
