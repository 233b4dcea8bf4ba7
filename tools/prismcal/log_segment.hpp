// SPDX-License-Identifier: MIT
// Reads one segment of prismd's log (format 1 or 2), row by row, and checks it against its end line.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/second_averager.hpp"
#include "daemon/pipeline/stored_segments.hpp"

namespace prism::recordings {

struct LogRow {
  compensation::SecondMean second_mean;
  double value = kUnknown;  ///< value of the requested column
  std::size_t line = 0;     ///< line of the file, from 1
  std::size_t number = 0;   ///< number of the row in the file, from 1; counts damaged rows
};

/// A row that is left out, or an entire file (line 0).
struct LeftOutRow {
  std::string path;
  std::size_t line = 0;
  std::string why;
};

/// How a segment ended.
enum class SegmentEnd {
  kIntact,     ///< matches its end line (format 1: its last line is complete)
  kOpen,       ///< no end yet: prismd still writes it
  kTruncated,  ///< no end: prismd was killed, power was lost, or it is a copy; rows are valid
  kChanged,    ///< differs from its end line, or has damaged rows or bytes after the end line
};

struct LogRowLayout;

/// open_log_segment() sets the members up to first_second, read_log_segment() the others.
struct LogSegment {
  std::string path, file;
  int format = 1;
  std::map<std::string, std::string> metadata;         ///< "# key: value" above the columns
  std::string comments;                                ///< all lines that begin with '#'
  std::string session;                                 ///< format 2; empty: none
  std::optional<pipeline::SupersededRows> superseded;  ///< rows that are repeated here
  std::optional<pipeline::LogPosition> position;       ///< nullopt: of 0.3 or older
  std::shared_ptr<const LogRowLayout> layout;          ///< null: the segment ends before its columns and has no rows
  std::optional<std::int64_t> first_second;            ///< of the first readable row

  std::string sha256;
  std::size_t rows = 0;             ///< readable rows
  std::vector<LeftOutRow> damaged;  ///< unreadable rows before the last good row: not a truncation
  bool read_failed = false;         ///< the disk failed; the last of `damaged` has the place and the reason
  SegmentEnd end = SegmentEnd::kIntact;
  std::size_t truncated_bytes = 0;  ///< bytes after the last complete row
  std::size_t truncated_line = 0;   ///< line of the first of them

  std::string value(const std::string& key) const;  ///< metadata value; empty: none
};

/// Returns true if the first line and the columns are those of a log. Extracts of a log with other columns are CSV
/// tables.
bool is_log(const std::string& path);

/// Reads the lines above the rows, and the first row. Rows parse `column`, if not empty, as numbers into LogRow::value
/// (an empty field is kUnknown). Errors, with file and line: not a log of prismd, a newer format, an unknown column.
Result<LogSegment> open_log_segment(const std::string& path, const std::string& column = {});

/// Called with each readable row of a segment in order; it may take the row.
using OnSegmentRow = std::function<Result<void>(LogRow& row)>;

/// Reads the rows in order, in constant memory, and completes the segment. An incomplete end, as after a power failure,
/// and damaged rows are not errors but are listed. Errors: only those of `on_row`, which end the reading.
Result<void> read_log_segment(LogSegment& segment, const OnSegmentRow& on_row);

}  // namespace prism::recordings
