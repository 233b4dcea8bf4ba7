// SPDX-License-Identifier: MIT
// A table without a fixed meaning of its columns, for fit, cv and predict: columns by name, as numbers.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/tables/plain_table.hpp"

namespace prism::recordings {

/// Values of several columns.
struct CsvColumns {
  Eigen::MatrixXd values;         ///< one row per column of the table (d × N); a hole is kUnknown
  std::vector<std::string> text;  ///< the rows as in the file; only if asked for
  std::string header;             ///< the names as in the file, with its separator
  char separator = ',', decimal = '.';

  /// Removes the rows with a hole in any column. Returns their number.
  std::size_t drop_holes();
};

/// Reads columns by name or number. A column whose header states a unit in brackets or in a row of units is converted
/// to deg/h, degC, V or s. Announces how the table was understood. `time`: the one of `names` that is a time, in
/// seconds; empty: none. Errors, with line and column: those of PlainTable.
Result<CsvColumns> read_csv_columns(const std::string& path, const std::vector<std::string>& names,
                                    const tables::TableOptions& options = {}, bool keep_text = false,
                                    const std::string& time = {});

}  // namespace prism::recordings
