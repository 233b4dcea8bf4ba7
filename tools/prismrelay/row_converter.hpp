// SPDX-License-Identifier: MIT
// A line of a log → a line of COPY for prism.rows.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace prism::prismrelay {

/// What a page says of one row's place.
struct RowPosition {
  std::string_view prefix;  ///< gyro, axis and log as fields of CSV, with a comma behind each
  std::uint64_t segment = 0, row = 0;
};

/// For the columns of one segment. What stands in a line is looked at before it leaves: one value that the server
/// refuses would hold up all rows of all gyros.
class RowConverter {
 public:
  /// `columns` as above a segment's rows; readers go by names.
  explicit RowConverter(std::string_view columns);

  /// The columns of COPY, in the order that append() writes.
  static std::string copy_columns();

  /// Appends the row to `csv`; the day of its arrival (since 1970 UTC) to `day`, and the arrival itself (s). Where the
  /// line is no row nothing is appended, and why is returned: no text, no NUL, nothing beyond the table's types passes.
  std::string append(std::string& csv, const RowPosition& place, std::string_view line, std::int64_t& day,
                     double& arrival_s) const;

 private:
  int known_[32];                     ///< by column of the table: index into the line's fields, −1: not there
  std::vector<std::string> sensors_;  ///< by index of the line's fields; empty: no sensor
  std::size_t fields_ = 0;
};

}  // namespace prism::prismrelay
