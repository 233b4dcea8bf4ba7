// SPDX-License-Identifier: MIT
#include "tools/prismrelay/row_converter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "base/escape.hpp"
#include "base/text_number.hpp"
#include "compensation/sensors.hpp"

namespace prism::prismrelay {
namespace {

using compensation::ColumnInfo;
using compensation::ColumnType;
using compensation::kColumnInfo;

constexpr std::size_t kTime = compensation::column_index("time_s"), kArrival = compensation::column_index("arrival_s");

// The times are converted; all other columns have the same name in the log and in prism.rows.
bool is_copied(const ColumnInfo& column) { return column.type != ColumnType::kTime; }

const char* sql_type(ColumnType type) {
  switch (type) {
    case ColumnType::kReal:
      return "double precision";
    case ColumnType::kInteger:
      return "integer";
    case ColumnType::kUnsigned:
      return "bigint";
    case ColumnType::kFlag:
      return "smallint";
    case ColumnType::kTime:
    case ColumnType::kText:
      break;
  }
  return "text";
}

constexpr double kMaxTime_s = 9.2e9;  // the year 2261
constexpr std::int64_t kDay_s = 86400;

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t comma = line.find(',');
    fields.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

bool is_integer(std::string_view text, std::int64_t max) {
  const auto value = parse_number<std::int64_t>(text);
  return value && *value >= -max && *value <= max;
}

bool is_name(std::string_view text) {
  return text.size() <= 200 && std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return (c >= 'a' && c <= 'z') || c == '_' || c == '+';
         });
}

bool is_valid(ColumnType type, std::string_view text) {
  switch (type) {
    case ColumnType::kReal:
      return parse_number<double>(text).has_value();
    case ColumnType::kInteger:
      return is_integer(text, INT32_MAX);
    case ColumnType::kUnsigned:
      return is_integer(text, INT64_MAX);
    case ColumnType::kFlag:
      return is_integer(text, INT16_MAX);
    case ColumnType::kTime:
    case ColumnType::kText:
      break;
  }
  return is_name(text);
}

bool is_sensor(std::string_view name) {
  const bool allowed = std::all_of(name.begin(), name.end(),
                                   [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '.'; });
  return allowed && sensor_of_column(name);
}

// The day of to_timestamp(arrival_s): PostgreSQL rounds to microseconds since 2000, ties to even.
std::int64_t stored_day(double arrival_s) {
  constexpr std::int64_t kEpoch_s = 946'684'800, kDay_us = kDay_s * 1'000'000;
  const auto since_2000_us = static_cast<std::int64_t>(std::rint((arrival_s - kEpoch_s) * 1e6));
  return (since_2000_us + kEpoch_s * 1'000'000) / kDay_us;
}

std::string in_quotes(std::string_view text) { return "\"" + shortened(text, 40) + "\""; }

}  // namespace

RowConverter::RowConverter(std::string_view columns) {
  field_of_.fill(-1);
  const auto names = split(columns);
  field_count_ = names.size();
  sensors_.resize(field_count_);
  for (std::size_t i = 0; i < field_count_; ++i) {
    if (const std::size_t column = compensation::column_index(names[i]); column < kColumnInfo.size()) {
      field_of_[column] = static_cast<int>(i);
    } else if (is_sensor(names[i])) {
      sensors_[i] = names[i];
    }
  }
}

std::string RowConverter::copy_columns() {
  std::string text = "gyro, axis, log, segment, row_number, arrival_s, time_s, sensors";
  for (const ColumnInfo& column : kColumnInfo) {
    if (is_copied(column)) (text += ", ") += column.name;
  }
  return text;
}

std::string RowConverter::table_columns() {
  std::string text;
  for (const ColumnInfo& column : kColumnInfo) {
    if (is_copied(column)) text += fmt::format("  {} {},\n", column.name, sql_type(column.type));
  }
  return text;
}

std::string RowConverter::append(std::string& csv, const RowPosition& position, std::string_view line,
                                 std::int64_t& day, double& arrival_s) const {
  const auto fields = split(line);
  if (fields.size() != field_count_) return fmt::format("found {} fields, expected {}", fields.size(), field_count_);
  const auto at = [&](std::size_t column) {
    return field_of_[column] < 0 ? std::string_view() : fields[field_of_[column]];
  };
  const auto time_s = parse_number<double>(at(kTime));
  if (!time_s || std::abs(*time_s) > kMaxTime_s) return "time_s: found " + in_quotes(at(kTime));
  // Logs of earlier versions have no arrival.
  const auto arrival = at(kArrival).empty() ? time_s : parse_number<double>(at(kArrival));
  if (!arrival || !(*arrival >= 0 && *arrival < kMaxTime_s)) return "arrival_s: found " + in_quotes(at(kArrival));
  arrival_s = *arrival;
  for (std::size_t c = 0; c < kColumnInfo.size(); ++c) {
    if (is_copied(kColumnInfo[c]) && !at(c).empty() && !is_valid(kColumnInfo[c].type, at(c)))
      return fmt::format("{}: found {}", kColumnInfo[c].name, in_quotes(at(c)));
  }
  std::string sensors;
  for (std::size_t i = 0; i < field_count_; ++i) {
    if (sensors_[i].empty() || fields[i].empty()) continue;
    const auto value = parse_number<double>(fields[i]);
    if (!value) return fmt::format("{}: found {}", sensors_[i], in_quotes(fields[i]));
    // Formats the value again, because JSON does not allow .5.
    fmt::format_to(std::back_inserter(sensors), "{}\"\"{}\"\":{}", sensors.empty() ? "" : ",", sensors_[i], *value);
  }
  day = stored_day(arrival_s);
  csv += position.prefix;
  fmt::format_to(std::back_inserter(csv), "{},{},{},{},", position.segment, position.row,
                 at(kArrival).empty() ? at(kTime) : at(kArrival), at(kTime));
  if (!sensors.empty()) ((csv += "\"{") += sensors) += "}\"";
  for (std::size_t c = 0; c < kColumnInfo.size(); ++c) {
    if (is_copied(kColumnInfo[c])) (csv += ',') += at(c);
  }
  csv += '\n';
  return "";
}

}  // namespace prism::prismrelay
