// SPDX-License-Identifier: MIT
// The lines of a log's text, and how its rows are parsed. Shared by log_segment.cpp and log_rows.cpp.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "base/result.hpp"
#include "compensation/compensated_text.hpp"
#include "tools/prismcal/recordings/log_segment.hpp"

namespace prism::recordings {

inline constexpr std::string_view kLogEndMark = "# end: ";

struct LogRowLayout {
  compensation::CsvLayout columns;
  std::optional<std::size_t> column;           ///< index of the requested column
  std::size_t head_bytes = 0, head_lines = 0;  ///< up to the first row
};

/// Parses rows of one layout, one after the other, in the same memory.
class LogRowParser {
 public:
  /// `layout` must outlive the parser.
  explicit LogRowParser(const LogRowLayout& layout) : layout_(layout) {}

  /// Errors, with an empty place: a field that is not valid.
  Result<void> parse(std::string_view line);
  /// Of the row that was parsed.
  const compensation::SecondMean& second_mean() const { return row_.window.second_mean; }
  double value() const { return value_; }  ///< of the requested column

 private:
  const LogRowLayout& layout_;
  compensation::CompensatedWindow row_;
  double value_ = kUnknown;
};

/// Iterates over the complete lines of a text; skips a last line without a line end.
class LogLines {
 public:
  explicit LogLines(std::string_view text) : text_(text) {}

  bool next() {
    const std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos) return false;
    begin_ = at_;
    line_ = text_.substr(at_, end - at_);
    if (!line_.empty() && line_.back() == '\r') line_.remove_suffix(1);
    at_ = end + 1;
    ++number_;
    return true;
  }
  std::string_view line() const { return line_; }
  std::size_t number() const { return number_; }
  std::size_t begin() const { return begin_; }    ///< position of the line in the text
  std::size_t next_begin() const { return at_; }  ///< position of the next line

 private:
  std::string_view text_, line_;
  std::size_t at_ = 0, begin_ = 0, number_ = 0;
};

}  // namespace prism::recordings
