// SPDX-License-Identifier: MIT
// A plain table in CSV: names on top, one row a sample; columns become numbers when they are asked for.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::recordings {

class CsvTable {
 public:
  /// Reads text as CsvLines takes it, with a line of names. Refused with file and line: no such file, no row, a row
  /// with another number of fields, a name given twice.
  static Result<CsvTable> read(const std::string& path);

  const std::string& path() const { return path_; }
  const std::string& sha256() const { return sha256_; }
  const std::vector<std::string>& names() const { return names_; }
  std::size_t rows() const { return lines_.size(); }
  /// A column's finite numbers; refused with line and column: no such name, an empty field, no finite number.
  Result<std::vector<double>> column(const std::string& name) const;
  /// The same of several, one column a row of the matrix (d × N).
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
