// SPDX-License-Identifier: MIT
// A table without a fixed meaning of its columns, for fit, cv and predict: columns by name, as numbers.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/tables/table_source.hpp"

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

class CsvTable {
 public:
  /// Detects how the table is written (../tables/dialect.hpp). Errors: those of open_table().
  static Result<CsvTable> read(const std::string& path, const tables::TableOptions& options = {});

  const std::string& path() const { return path_; }
  const std::string& sha256() const { return sha256_; }
  /// Reads columns by name or number. A column whose header states a unit in brackets or in a row of units is converted
  /// to deg/h, degC, V or s. Announces how the table was understood. Errors, with line and column: those of
  /// TableSource; no row. `times`: columns of `names` that are times, in seconds.
  Result<CsvColumns> columns(const std::vector<std::string>& names, bool keep_text = false,
                             const std::string& time = {}) const;
  /// One of them.
  Result<std::vector<double>> column(const std::string& name) const;

 private:
  std::string path_, sha256_;
  tables::TableOptions options_;
};

}  // namespace prism::recordings
