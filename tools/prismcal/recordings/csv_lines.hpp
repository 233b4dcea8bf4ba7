// SPDX-License-Identifier: MIT
// Reads CSV line by line: separators, comments, quotes and numbers, the same for all readers of tables.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file.hpp"

namespace prism::recordings {

/// Returns field `index` of a line without surrounding blanks and quotes, or nullopt if the line has fewer fields.
std::optional<std::string_view> csv_field(std::string_view line, char separator, std::size_t index);
/// Returns all fields of a line. An empty line has none.
std::vector<std::string> csv_fields(std::string_view line, char separator);

/// Returns the index of the column with this name, else with this number (from 1), or nullopt.
std::optional<std::size_t> csv_column(const std::vector<std::string>& names, const std::string& wanted);

/// Parses a field that is exactly one finite number; a leading '+' is allowed.
std::optional<double> csv_number(std::string_view field);

/// Reads comma-, semicolon- or tab-separated text. The first line determines the separator, tried in this order. A
/// quoted field cannot contain the separator. Skips a byte-order mark and the carriage return at the end of a line.
class CsvLines {
 public:
  /// Errors: those of FileReader::open().
  static Result<CsvLines> open(const std::string& path);

  /// Reads the next line that is neither empty nor a comment ('#'). Returns false at the end or on a read error.
  bool next();
  /// The read error, if any.
  Result<void> finish() const { return in_.finish(); }
  const std::string& line() const { return line_; }
  std::size_t number() const { return number_; }  ///< of the line, from 1
  std::string position() const;                   ///< "FILE:LINE"
  char separator() const { return separator_; }
  std::size_t field_count() const;
  std::vector<std::string> fields() const { return csv_fields(line_, separator_); }
  std::optional<std::string_view> field(std::size_t index) const { return csv_field(line_, separator_, index); }
  const std::string& comments() const { return comments_; }  ///< the comment lines read so far

 private:
  CsvLines(FileReader in, std::string where) : in_(std::move(in)), where_(std::move(where)) {}

  FileReader in_;
  std::string where_, line_ = {}, comments_ = {};
  std::size_t number_ = 0;
  char separator_ = 0;
};

}  // namespace prism::recordings
