// SPDX-License-Identifier: MIT
// The format of a column of times, by its cells.
#include <fmt/format.h>

#include <algorithm>

#include "base/escape.hpp"
#include "tools/prismcal/tables/cell.hpp"
#include "tools/prismcal/tables/time_format.hpp"

namespace prism::tables {
namespace {

using Rows = std::vector<std::vector<std::string>>;

const char* order_text(DateOrder order) {
  return order == DateOrder::kYearFirst  ? "year-month-day"
         : order == DateOrder::kDayFirst ? "day.month.year"
                                         : "month/day/year";
}

/// Returns true if the first cell of a column is a time of day without a date.
bool is_clock(const Rows& sample, std::size_t column) {
  if (sample.empty() || column >= sample[0].size()) return false;
  const auto clock = date_in(sample[0][column]);
  return clock && clock->order == DateOrder::kNone && clock->has_time;
}

Error ambiguous_date(const std::string& where, const Header& header, const Rows& sample, std::size_t time) {
  for (const auto& row : sample) {
    const auto date = date_in(row[time]);
    if (!date || date->order != DateOrder::kEither || date->first == date->second) continue;
    const auto text = [&](int month, int day) { return fmt::format("{:04}-{:02}-{:02}", date->year, month, day); };
    return Error{where,
                 fmt::format("column {}: two readings are possible: \"{}\" is {} or {}; state --time-format dmy or "
                             "--time-format mdy",
                             header.text, row[time], text(date->second, date->first), text(date->first, date->second))};
  }
  return Error{where,
               fmt::format("column {}: two readings are possible: \"{}\" does not show whether the day or the month "
                           "is first; state --time-format dmy or --time-format mdy",
                           header.text, sample.front()[time])};
}

Result<TimeFormat> detect_text(const std::string& where, const std::vector<Header>& columns, const Rows& sample,
                               std::size_t time, const TableOptions& options) {
  TimeFormat format;
  format.kind = TimeKind::kText;
  const std::string& stated = options.time_format;
  const auto first = date_in(sample.front()[time]);
  if (!first)
    return make_error(where, fmt::format("column {}: found \"{}\", expected a time", columns[time].text,
                                         shortened(sample.front()[time])));
  format.has_date = first->order != DateOrder::kNone;
  format.has_zone = first->has_zone;
  if (!format.has_date && !first->has_seconds && stated != "clock")
    return make_error(where,
                      fmt::format("column {}: two readings are possible: \"{}\" is hours and minutes, or minutes and "
                                  "seconds; state --time-format clock for the first, write hh:mm:ss for the second",
                                  columns[time].text, sample.front()[time]));
  format.order = stated == "dmy" ? DateOrder::kDayFirst : stated == "mdy" ? DateOrder::kMonthFirst : DateOrder::kNone;
  if (format.order == DateOrder::kNone && format.has_date) {
    bool either = false;
    for (const auto& row : sample) {
      const auto date = date_in(row[time]);
      if (!date || date->order == DateOrder::kNone) continue;
      either = either || date->order == DateOrder::kEither;
      if (date->order != DateOrder::kEither) format.order = date->order;
    }
    if (either && format.order == DateOrder::kNone)
      return tl::unexpected<Error>(ambiguous_date(where, columns[time], sample, time));
  }
  if (format.has_date && !first->has_time && is_clock(sample, time + 1)) format.second = time + 1;
  format.text = format.has_date
                    ? std::string(order_text(format.order)) + (format.second || first->has_time ? " and time" : "")
                    : "time of day";
  if (format.second) {
    format.text += fmt::format(" of column {}", columns[*format.second].text);
    format.has_zone = date_in(sample.front()[*format.second])->has_zone;
  }
  if (!format.has_zone && format.has_date) format.text += ", no zone: taken for UTC";
  return format;
}

}  // namespace

Result<TimeFormat> detect_time(const std::string& path, const std::vector<Header>& columns, const Rows& sample,
                               std::size_t time, const std::string& unit, char decimal, const TableOptions& options) {
  if (sample.empty()) return make_error(path, "found no row");
  if (!options.time_format.empty() &&
      std::find(std::begin(kTimeFormats), std::end(kTimeFormats), options.time_format) == std::end(kTimeFormats))
    return make_error("--time-format", fmt::format("found \"{}\", expected one of {}", options.time_format,
                                                   fmt::join(kTimeFormats, ", ")));
  std::vector<double> numbers;
  std::size_t holes = 0;
  for (const auto& row : sample) {
    const auto number = number_in(row[time], decimal);
    if (number) numbers.push_back(*number);
    holes += is_hole(row[time]);
  }
  if (numbers.size() + holes < sample.size() || numbers.empty())
    return detect_text(path, columns, sample, time, options);
  // GPS: a week that is almost constant, and the second of the week next to it.
  const bool week = columns[time].name.find("eek") != std::string::npos || options.time_format == "gps";
  if (week && time + 1 < columns.size() && numbers.front() >= 500 && numbers.front() < 5000) {
    TimeFormat format;
    format.kind = TimeKind::kGps;
    format.second = time + 1;
    format.decimal = decimal;
    format.has_date = true;
    format.text = fmt::format("GPS week, and second of column {}", columns[time + 1].text);
    return format;
  }
  auto format = detect_number_time(path, columns[time], numbers, unit, options);
  if (format) format->decimal = decimal;
  return format;
}

}  // namespace prism::tables
