// SPDX-License-Identifier: MIT
// Splits lines into cells after RFC 4180 (libcsv): quotes, doubled quotes, separators and line ends within quotes.
#pragma once

#include <csv.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace prism::tables {

/// Separators: comma, semicolon, tab, bar or any other character; a blank for runs of blanks and tabs; 0 for one
/// column.
class RowSplitter {
 public:
  explicit RowSplitter(char separator);
  ~RowSplitter();
  RowSplitter(const RowSplitter&) = delete;
  RowSplitter& operator=(const RowSplitter&) = delete;

  /// Takes a line without its end. Returns true if a row is complete: false for an empty line, and while a quoted cell
  /// continues in the next line (is_open()).
  bool push(std::string_view line);
  /// A quoted cell has begun and not ended.
  bool is_open() const { return open_; }
  std::size_t open_bytes() const { return text_.size(); }  ///< of the row that is not complete
  std::size_t size() const { return ends_.size(); }
  /// A cell of the complete row, without surrounding blanks and quotes; valid until the next push().
  std::string_view cell(std::size_t i) const {
    const std::size_t begin = i == 0 ? 0 : ends_[i - 1];
    return std::string_view(text_).substr(begin, ends_[i] - begin);
  }
  std::vector<std::string> cells() const;
  /// The last cell of the row was quoted: it is complete even without a line end.
  bool last_is_quoted() const { return last_is_quoted_; }

 private:
  void begin();

  csv_parser parser_;
  char separator_;
  std::string text_, blanks_;
  std::vector<std::size_t> ends_;
  bool open_ = false, complete_ = false, last_is_quoted_ = false;
};

}  // namespace prism::tables
