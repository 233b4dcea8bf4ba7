// SPDX-License-Identifier: MIT
// One way to read the first lines of a table: with one separator and one decimal sign.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::tables {

struct SampleLine {
  std::size_t number = 0;
  std::string text;
  bool ended = true;
};

struct SampleRow {
  std::size_t number = 0;  ///< line of its first cell
  std::vector<std::string> cells;
  bool torn = false;  ///< the last line of the file, without an end
};

/// The lines as rows; empty lines, and rows of empty cells, are left out.
std::vector<SampleRow> split_sample(const std::vector<SampleLine>& lines, char separator);

/// Finds the rows of data: the most frequent width, and the columns whose cells are numbers, holes or times.
class Reading {
 public:
  Reading(std::vector<SampleRow> rows, char separator, char decimal, const std::vector<SampleLine>& comments,
          std::optional<int> header_row);

  char separator() const { return separator_; }
  char decimal() const { return decimal_; }
  std::size_t width() const { return width_ - (trailing_ ? 1 : 0); }
  bool trailing() const { return trailing_; }
  bool good() const { return start_ < rows_.size(); }  ///< at least one column has values
  bool clean() const { return clean_; }                ///< all columns have values
  double share() const { return share_; }              ///< of the columns that have values, 0 to 1
  bool has_names() const { return names_line_ > 0; }
  std::size_t names_line() const { return names_line_; }
  std::size_t units_line() const { return units_line_; }
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<std::string>& units() const { return units_; }
  bool names_line_has(char separator) const;
  const SampleRow& first() const { return rows_[start_]; }
  std::vector<std::vector<std::string>> data() const;
  /// True if the first rows have other values here than there.
  bool differs_from(const Reading& other) const;
  /// True if each decimal comma may as well separate groups of digits, as in 1,234.
  bool only_groups() const;
  std::string first_row_text() const;
  std::string first_row_text_of_groups() const;
  /// Errors: the line of names has another width than the rows.
  Result<void> check_names(const std::string& path) const;

 private:
  void find_width();
  void find_values();
  void find_start(std::optional<int> header_row);
  void find_names(const std::vector<SampleLine>& comments, std::optional<int> header_row);
  bool is_data(const SampleRow& row) const;
  bool has_number(const SampleRow& row) const;
  bool is_damaged_data(const SampleRow& row) const;  ///< more than half of its values can be read
  void drop_trailing();

  std::vector<SampleRow> rows_;
  char separator_, decimal_;
  std::size_t width_ = 0, start_ = 0;
  std::vector<bool> values_;  ///< columns with values
  bool clean_ = false, trailing_ = false;
  double share_ = 0;
  std::size_t names_line_ = 0, units_line_ = 0, other_width_ = 0, other_line_ = 0;
  std::vector<std::string> names_, units_;
};

/// Why a file has no reading: it is empty, or has names only, or text.
std::string no_numbers_text(const std::vector<SampleLine>& lines, const std::vector<SampleLine>& comments);

}  // namespace prism::tables
