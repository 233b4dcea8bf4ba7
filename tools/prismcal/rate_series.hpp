// SPDX-License-Identifier: MIT
// Reads one column of a CSV file or log as an evenly spaced rate for an Allan deviation.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/plain_table.hpp"

namespace prism::recordings {

struct RateSeriesChoice {
  std::string column;       ///< name, or number from 1; empty: "rate_deg_per_h", or the only column except the time
  std::string time_column;  ///< name or number; empty: the column whose name and unit are those of a time
  std::string unit;         ///< deg/h, deg/s, rad/s, arcsec/s; empty: by the column's header
  std::optional<double> interval_s;  ///< spacing of the rows; overrides the time column
  std::string axis;                  ///< selects one axis of a log with several
  tables::TableOptions table;        ///< how a table of another program is written
};

struct RateSeries {
  std::string column, unit;
  /// NaN for each missing value: an empty field, or a jump in time; evaluation::kAllanBreak between two records:
  /// sessions, or rows before and after a long gap.
  std::vector<double> rate_deg_per_h;
  double interval_s = 1;
  std::string
      interval_source;  ///< how it was found: "median step of time_s", "given", "assumed: …"; printed in reports
  std::size_t rows = 0;
  std::string gyro_serial, axis;        ///< of a log; empty: unknown
  std::optional<std::int64_t> begin_s;  ///< since 1970; nullopt: no date
  std::vector<std::string> notes;       ///< readable lines on rows left out, and on the time
};

/// Reads prismd's log, a file or a folder (log_folder.hpp), if no time column or interval is given. Otherwise a table
/// of another program (../tables/plain_table.hpp); sample_grid() decides the interval and the gaps. Errors, with file
/// and line: those of PlainTable, an unknown column, a unit that is not one of a rate, time that goes back, no row.
Result<RateSeries> read_rate_series(const std::string& path, const RateSeriesChoice& choice);

}  // namespace prism::recordings
