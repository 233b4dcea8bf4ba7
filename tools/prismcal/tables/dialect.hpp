// SPDX-License-Identifier: MIT
// How a table is written: encoding, separator, decimal sign, the lines before the data; detected from its first lines.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/tables/header_unit.hpp"
#include "tools/prismcal/tables/table_options.hpp"

namespace prism::tables {

struct Dialect {
  std::string encoding = "UTF-8";
  char separator = ',';  ///< see RowSplitter
  char decimal = '.';
  std::size_t header_line = 0;  ///< line of the names; 0: none, columns are named "1", "2", …
  std::size_t units_line = 0;   ///< line of the units; 0: none
  std::size_t first_line = 1;   ///< line of the first row
  std::size_t width = 0;        ///< cells of each row
  bool trailing = false;        ///< each row has one more, empty cell: it ends with a separator
  std::vector<Header> columns;  ///< `width` of them
  /// Rows at the start of the data, for the detection of times.
  std::vector<std::vector<std::string>> sample;

  std::string separator_text() const;  ///< "comma", "tab", …
  /// "UTF-8, semicolons, decimal comma, names in line 3, units in line 4".
  std::string text() const;
};

/// Reads up to 2000 lines of the file. Errors: those of TextLines; no row of numbers; a row of names with another width
/// than the rows; two readings that are both possible, shown for the first row, with the option that decides.
Result<Dialect> detect_dialect(const std::string& path, const TableOptions& options);

/// True for a line that is not part of the table: '#', '%' or '//' first, except for Excel's "#NUM!" and the like.
bool is_comment(std::string_view line);

}  // namespace prism::tables
