// SPDX-License-Identifier: MIT
// Reads one column of a CSV file or log as an evenly spaced rate for an Allan deviation.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::recordings {

struct RateSeriesChoice {
  std::string column;       ///< name, or number from 1; empty: "rate_deg_per_h", or the only column except the time
  std::string time_column;  ///< name or number, seconds; empty: "time_s" or "t_s" if present
  std::string unit;         ///< deg/h, deg/s, rad/s, arcsec/s; empty: by the column's name, else deg/h
  std::optional<double> interval_s;  ///< spacing of the rows; overrides the time column
  std::string axis;                  ///< selects one axis of a log with several
};

struct RateSeries {
  std::string column, unit;
  std::vector<double> rate_deg_per_h;  ///< NaN in gaps: an empty field, or a jump in time
  double interval_s = 1;
  std::string
      interval_source;  ///< how it was found: "median step of time_s", "given", "assumed: …"; printed in reports
  std::size_t rows = 0;
  std::vector<std::string> notes;  ///< readable lines on rows left out
};

/// Reads prismd's log, a file or a folder (log_folder.hpp), if no time column or interval is given. Otherwise reads the
/// syntax of CsvLines, with or without a line of names. A time step of more than 1.5 intervals is a gap. Errors, with
/// file and line: an unreadable file, an unknown column, a field that is not a number, time that does not increase, no
/// row.
Result<RateSeries> read_rate_series(const std::string& path, const RateSeriesChoice& choice);

}  // namespace prism::recordings
