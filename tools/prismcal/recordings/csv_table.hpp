// SPDX-License-Identifier: MIT
// A plain table in CSV: names on top, one row a sample; columns become numbers when they are asked for.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/result.hpp"

namespace prism::recordings {

class CsvTable {
 public:
  /// Reads comma-, semicolon- or tab-separated text with a line of names. '#' lines and empty lines are skipped.
  /// Refused with file and line: no such file, no row, a row with another number of fields, a name given twice.
  static Result<CsvTable> read(const std::string& path);
  static Result<CsvTable> parse(std::string text, const std::string& where);

  const std::string& path() const { return where_; }
  const std::string& sha256() const { return sha256_; }
  const std::vector<std::string>& names() const { return names_; }
  std::size_t rows() const { return lines_.size(); }
  bool has(const std::string& name) const;
  /// A column's finite numbers; refused with line and column: no such name, an empty field, no finite number.
  Result<std::vector<double>> column(const std::string& name) const;
  /// The same of several, one column a row of the matrix (d × N).
  Result<Eigen::MatrixXd> columns(const std::vector<std::string>& names) const;
  std::string_view header() const { return header_; }
  std::string_view row(std::size_t i) const { return lines_[i].text; }
  char separator() const { return separator_; }

 private:
  struct Line {
    std::string_view text;
    std::size_t number;
  };
  std::string where_, text_, sha256_;
  std::string_view header_;
  std::vector<std::string> names_;
  std::vector<Line> lines_;
  char separator_ = ',';
};

/// "a, b,c" → names.
std::vector<std::string> split_names(const std::string& text);

}  // namespace prism::recordings
