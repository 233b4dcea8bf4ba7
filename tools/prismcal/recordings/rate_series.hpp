// SPDX-License-Identifier: MIT
// One column of a CSV file as an evenly spaced rate: what an Allan deviation is taken of.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::recordings {

struct RateSeriesChoice {
  std::string column;       ///< name, or number from 1; empty: "rate_deg_per_h", or the only column that is no time
  std::string time_column;  ///< name or number, seconds; empty: "time_s" or "t_s" where there is one
  std::string unit;         ///< deg/h, deg/s, rad/s, arcsec/s; empty: by the column's name, else deg/h
  std::optional<double> interval_s;  ///< spacing of the rows; overrides the time column
  std::string axis;                  ///< of a log of several axes: the one that is wanted
};

struct RateSeries {
  std::string column, unit;
  std::vector<double> rate_deg_per_h;  ///< NaN where the file has a hole: an empty field, or a jump in time
  double interval_s = 1;
  std::string interval_source;  ///< "median of time_s", "given", "assumed": the report says which
  std::size_t rows = 0;
  std::vector<std::string> notes;  ///< what was left out, for people
};

/// Reads prismd's log, a file or a folder, by session (log_folder.hpp), where neither time column nor interval is
/// given. Else reads comma-, semicolon- or tab-separated text, with or without a line of names; lines that begin with
/// '#' and empty lines are skipped. A step in time of more than 1.5 intervals is a hole. Refused with file and line: no
/// such file or column, a field that is no number, time that does not increase, a file without a row.
Result<RateSeries> read_rate_series(const std::string& path, const RateSeriesChoice& choice);

}  // namespace prism::recordings
