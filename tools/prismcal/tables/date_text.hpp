// SPDX-License-Identifier: MIT
// Dates and times of day as text: ISO 8601, day.month.year, month/day/year, with month names, with zone or without.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace prism::tables {

/// Order of the numbers of a date. kEither: day and month are both at most 12 and the text does not decide.
enum class DateOrder { kNone, kYearFirst, kDayFirst, kMonthFirst, kEither };

/// The contents of a cell. Times are ns.
struct DateText {
  DateOrder order = DateOrder::kNone;   ///< kNone: no date
  int year = 0, first = 0, second = 0;  ///< year, and the two other numbers in the order of the text
  bool has_time = false, has_seconds = false, has_zone = false;
  std::int64_t time_of_day_ns = 0;
  std::int64_t zone_s = 0;  ///< to subtract, s
};

/// Reads a date, a time of day (with ':'), or a date and then a time. A fraction of a second may follow '.' or ','.
/// AM, PM, Z, UTC, GMT and ±hh:mm are known; a bracket before or after is ignored. Returns nullopt for any other text,
/// for an impossible date and for years of two digits.
std::optional<DateText> date_in(std::string_view cell);

/// Nanoseconds since 1970 UTC; `order` decides between day and month where the text does not (kEither). A cell without
/// a date counts from 0. Returns nullopt for a date that does not exist in this order.
std::optional<std::int64_t> nanoseconds_of(const DateText& date, DateOrder order);

}  // namespace prism::tables
