// SPDX-License-Identifier: MIT
// Converts a line of a log to a line of COPY for prism.rows.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/compensated_text.hpp"

namespace prism::prismrelay {

/// Position of a row, from its page.
struct RowPosition {
  std::string_view prefix;  ///< gyro, axis and log as CSV fields, each followed by a comma
  std::uint64_t segment = 0, row = 0;
};

/// Converts the rows of one segment. Checks every value, because one that the server rejects would block all rows of
/// all gyros.
class RowConverter {
 public:
  /// `columns`: the header line of the segment. Columns are identified by name; unknown ones are skipped.
  explicit RowConverter(std::string_view columns);

  /// The columns of COPY, in the order of append().
  static std::string copy_columns();
  /// The same columns of the log in CREATE TABLE: "  samples integer,\n…".
  static std::string table_columns();

  /// Appends the row to `csv`, and sets the day of its arrival (since 1970 UTC) and the arrival (s). Returns an error
  /// and appends nothing if a field is invalid for the column's type; else returns an empty string.
  std::string append(std::string& csv, const RowPosition& position, std::string_view line, std::int64_t& day,
                     double& arrival_s) const;

 private:
  std::array<int, compensation::kColumnInfo.size()> field_of_;  ///< index of the line's field, −1: absent
  std::vector<std::string> sensors_;                            ///< by index of the line's field; empty: not a sensor
  std::size_t field_count_ = 0;
};

}  // namespace prism::prismrelay
