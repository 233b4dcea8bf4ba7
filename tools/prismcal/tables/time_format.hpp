// SPDX-License-Identifier: MIT
// How the time of a table is written, detected from its first rows, and the conversion to nanoseconds.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/tables/date_text.hpp"
#include "tools/prismcal/tables/header_unit.hpp"
#include "tools/prismcal/tables/table_options.hpp"

namespace prism::tables {

/// Values of --time-format.
inline constexpr const char* kTimeFormats[] = {"number", "unix", "excel", "datenum", "labview",
                                               "gps",    "iso",  "dmy",   "mdy",     "clock"};

enum class TimeKind {
  kNumber,   ///< seconds, or another unit, from any origin
  kUnix,     ///< since 1970 UTC, in s, ms, us or ns; since 1601 or year 1 in 100 ns
  kExcel,    ///< days since 1899-12-30
  kDatenum,  ///< MATLAB: days since year 0
  kLabview,  ///< seconds since 1904
  kGps,      ///< week, and second of the week in the next column; no leap seconds
  kText,     ///< date and time, or a time of day
};

struct TimeFormat {
  TimeKind kind = TimeKind::kNumber;
  double unit_s = 1;             ///< of a number
  std::int64_t offset_s = 0;     ///< from 1970 to the origin of a number: -11 644 473 600 for the year 1601
  double scale = 1, offset = 0;  ///< applied to the number first (--map)
  DateOrder order = DateOrder::kNone;
  std::optional<std::size_t> second;  ///< column of the time of day next to the date, or of the GPS second
  char decimal = '.';
  bool has_date = false, has_zone = false;
  std::string text;  ///< for the line of how the file was understood

  /// Nanoseconds since 1970 UTC, or since the origin of the number. `other_cell`: the cell of the column `second`.
  /// nullopt: the cell is not a time in this format.
  std::optional<std::int64_t> parse(std::string_view cell, std::string_view other_cell) const;
  /// The same for a value that is a number already (a .mat file).
  std::optional<std::int64_t> from_number(double value, double other_cell) const;
};

/// Detects the format of column `time` of the sample. `unit`: of --map; empty: by --time-unit, else by the header.
/// Errors: not a time; two formats are possible, with the option that decides.
Result<TimeFormat> detect_time(const std::string& path, const std::vector<Header>& columns,
                               const std::vector<std::vector<std::string>>& sample, std::size_t time,
                               const std::string& unit, char decimal, const TableOptions& options);

/// The same from numbers: times in seconds or days of a .mat file, or cells that are numbers.
Result<TimeFormat> detect_number_time(const std::string& where, const Header& header, const std::vector<double>& values,
                                      const std::string& unit, const TableOptions& options);

}  // namespace prism::tables
