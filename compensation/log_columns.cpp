// SPDX-License-Identifier: MIT
#include "compensation/log_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/text_number.hpp"

namespace prism::compensation {
namespace {

constexpr int kArrivalDecimals = 3;
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
bool parse(std::string_view field, std::size_t before, double& value, int decimals) {
  if (parse_fixed(field, before, decimals, value)) return true;
  value = kUnknown;
  return field.empty() || take_number(field, value);
}

bool parse(std::string_view field, std::size_t /*before*/, std::uint32_t& value) { return take_number(field, value); }

void append_utc(std::string& text, const CompensatedWindow& row) {
  text += utc_text(row.window.second_mean.second + 1);
}

void append_second(std::string& text, const CompensatedWindow& row) {
  append_integer(text, row.window.second_mean.second + 1);
}

bool parse_second(std::string_view field, std::size_t /*before*/, CompensatedWindow& row) {
  std::int64_t end_s = 0;
  const bool good = take_number(field, end_s) && end_s >= -kFarthestSecond && end_s <= kFarthestSecond;
  if (good) row.window.second_mean.second = end_s - 1;
  return good;
}

void append_quality(std::string& text, const CompensatedWindow& row) { text += quality_text(row.correction.quality); }

bool parse_quality(std::string_view field, std::size_t /*before*/, CompensatedWindow& row) {
  const bool good = field == "good";
  const std::uint32_t quality = good ? kGood : compensation::parse_quality(field);
  const bool implausible = (quality & kImplausible) != 0;
  SecondMean& second_mean = row.window.second_mean;
  row.correction.quality = quality;
  // The log does not state which quantity was implausible, so the reader uses none of this second.
  second_mean.implausible = second_mean.all_implausible = {implausible, implausible, implausible};
  second_mean.clocks_differ = (quality & kClocksDiffer) != 0;
  if (good) return true;
  // A truncated or unknown name must not read as "good".
  char text[kQualityChars];
  return std::string_view(text, put_quality(text, quality)) == field;
}

void append_arrival(std::string& text, const CompensatedWindow& row) {
  const std::int64_t whole_ms = row.window.second_mean.arrival_ns / 1'000'000;
  if (whole_ms > 0) text += fmt::format("{}.{:03}", whole_ms / 1000, whole_ms % 1000);
}

bool parse_arrival(std::string_view field, std::size_t before, CompensatedWindow& row) {
  double arrival_s = 0;
  if (!field.empty() && !parse(field, before, arrival_s, kArrivalDecimals)) return false;
  if (!(arrival_s >= 0 && arrival_s <= static_cast<double>(kFarthestSecond))) return false;
  row.window.second_mean.arrival_ns = std::llround(arrival_s * 1e3) * 1'000'000;
  return true;
}

void append_partial(std::string& text, const CompensatedWindow& row) {
  text += row.window.second_mean.partial ? '1' : '0';
}

bool parse_partial(std::string_view field, std::size_t /*before*/, CompensatedWindow& row) {
  const char digit = field.size() == 1 ? field.front() : ' ';
  row.window.second_mean.partial = digit == '1';
  return digit == '0' || digit == '1';
}

}  // namespace column
}  // namespace prism::compensation
