// SPDX-License-Identifier: MIT
// CSV line by line: the separators, comments, quotes and numbers that every reader of a table takes.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file.hpp"

namespace prism::recordings {

/// Field `index` of a line, without the blanks and quotes around it; nothing where the line is shorter.
std::optional<std::string_view> csv_field(std::string_view line, char separator, std::size_t index);
/// All of them; none of an empty line.
std::vector<std::string> csv_fields(std::string_view line, char separator);

/// Which of the columns a person means: by its name, or else by its number from 1; nothing where there is none.
std::optional<std::size_t> csv_column(const std::vector<std::string>& names, const std::string& wanted);

/// A finite number, a '+' before it allowed; nothing else stands in the field.
std::optional<double> csv_number(std::string_view field);

/// Comma-, semicolon- or tab-separated text, by what the first line holds, in this order. A quoted
/// field cannot hold the separator. A byte-order mark and the carriage return of a line's end are skipped.
class CsvLines {
 public:
  /// Errors: as FileReader::open().
  static Result<CsvLines> open(const std::string& path);

  /// Goes to the next line that is neither empty nor a comment ('#'). Returns false at the end or on a read error.
  bool next();
  /// The read error, if any.
  Result<void> finish() const { return in_.finish(); }
  const std::string& line() const { return line_; }
  std::size_t number() const { return number_; }  ///< of the line, from 1
  std::string place() const;                      ///< "FILE:LINE"
  char separator() const { return separator_; }
  std::size_t field_count() const;
  std::vector<std::string> fields() const { return csv_fields(line_, separator_); }
  std::optional<std::string_view> field(std::size_t index) const { return csv_field(line_, separator_, index); }
  const std::string& comments() const { return comments_; }  ///< the lines so far that begin with '#'

 private:
  CsvLines(FileReader in, std::string where) : in_(std::move(in)), where_(std::move(where)) {}

  FileReader in_;
  std::string where_, line_ = {}, comments_ = {};
  std::size_t number_ = 0;
  char separator_ = 0;
};

}  // namespace prism::recordings
