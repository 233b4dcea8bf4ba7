// SPDX-License-Identifier: MIT
// One cell of a table: a number, a hole, a point in time or other text.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace prism::tables {

/// Parses a cell that is exactly one finite number, with '.' or ',' as decimal sign. Groups of three digits are read
/// only where they cannot be decimals: "1,234,567" and "1,234.5" with '.', "1.234.567" and "1.234,5" with ','.
std::optional<double> number_in(std::string_view cell, char decimal);

/// True for "1,234" (one group of three digits, no leading zero): 1.234 with a decimal comma, 1234 with grouped digits.
/// `mark`: the comma, or the point of "1.234".
bool may_be_grouped(std::string_view cell, char mark = ',');

/// The integers and groups of a column, "743" and "1.006", which is 1 006 or 1.006. Any other number (of 1 000 or more,
/// or with another number of decimals) shows which; and "25.001" next to 25 is a decimal.
class GroupWatch {
 public:
  explicit GroupWatch(char decimal) : decimal_(decimal) {}
  void see(std::string_view cell);
  bool is_doubtful() const { return !shown_ && !group_.empty() && least_group_ < 10 * largest_integer_; }
  const std::string& group() const { return group_; }  ///< the first cell that may be one

 private:
  char decimal_;
  bool shown_ = false;
  int largest_integer_ = 0, least_group_ = 1'000'000;
  std::string group_;
};

/// True for what programs write for an unknown value: nothing, NaN, N/A, -, `#NUM!`, inf and the like.
bool is_hole(std::string_view cell);

}  // namespace prism::tables
