// SPDX-License-Identifier: MIT
// A CSV table without timestamps: a line of names, then one sample per row. Columns are parsed on demand.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::recordings {

class CsvTable {
 public:
  /// Reads the syntax of CsvLines, with a line of names. Errors, with file and line: an unreadable file, no row, a row
  /// with another number of fields, a duplicate name.
  static Result<CsvTable> read(const std::string& path);

  const std::string& path() const { return path_; }
  const std::string& sha256() const { return sha256_; }
  const std::vector<std::string>& names() const { return names_; }
  std::size_t rows() const { return lines_.size(); }
  /// Parses a column. Errors, with line and column: an unknown name, a field that is not a finite number.
  Result<std::vector<double>> column(const std::string& name) const;
  /// Parses several columns. Each is a row of the matrix (d × N).
  Result<Eigen::MatrixXd> columns(const std::vector<std::string>& names) const;
  const std::string& header() const { return header_; }
  const std::string& row(std::size_t i) const { return lines_[i].text; }
  char separator() const { return separator_; }

 private:
  struct NumberedLine {
    std::string text;
    std::size_t number;
  };
  std::string path_, sha256_, header_;
  std::vector<std::string> names_;
  std::vector<NumberedLine> lines_;
  char separator_ = ',';
};

}  // namespace prism::recordings
