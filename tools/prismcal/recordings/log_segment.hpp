// SPDX-License-Identifier: MIT
// One segment of prismd's log, of format 1 or 2: its rows, and how much of what it says of itself holds.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/second_averager.hpp"

namespace prism::recordings {

struct LogRow {
  compensation::SecondMean second_mean;
  double value = kUnknown;  ///< of the column that was asked for
  std::size_t line = 0;     ///< of the file, from 1
  std::size_t number = 0;   ///< among the rows of the file, from 1; damaged ones count
};

/// A row that does not count, or a whole file of them (line 0).
struct LeftOutRow {
  std::string path;
  std::size_t line = 0;
  std::string why;
};

/// How a segment ended.
enum class SegmentEnd {
  kIntact,     ///< with its sum, which holds (format 1: with a whole line)
  kOpen,       ///< not yet: a living prismd writes it
  kTruncated,  ///< without: prismd or the machine was ended by force, or it is a copy. Its rows are good
  kChanged,    ///< with a sum that does not hold: what stands in it was not written by prismd like that
};

struct LogSegment {
  std::string path, file, sha256;
  int format = 1;
  std::map<std::string, std::string> metadata;  ///< "# key: value" above the columns
  std::string comments;                         ///< the same as lines
  std::string session;                          ///< format 2
  std::string supersedes_file;  ///< format 2: whose rows from supersedes_row on (from 1) stand here again
  std::uint64_t supersedes_row = 0;
  std::vector<LogRow> rows;
  std::vector<LeftOutRow> damaged;  ///< rows that cannot be read and that no tear explains: others stand behind them
  SegmentEnd end = SegmentEnd::kIntact;
  std::size_t truncated_bytes = 0;  ///< at its end, without a whole row in them
  std::size_t truncated_line = 0;   ///< where those begin

  std::string value(const std::string& key) const;  ///< of the metadata; empty: it does not say
};

/// True where a file's first line says so and its columns are a log's; what somebody cut out of a log is a plain table.
bool is_log(const std::string& path);

/// Reads one. `column`, where it is not empty, is read as numbers (an empty field is kUnknown). What a power cut leaves
/// at the end of a segment is no refusal, and damaged rows within are listed. Refused with file and line: what is no
/// log of prismd, a log of a newer format, a column that is not there.
Result<LogSegment> read_log_segment(const std::string& path, const std::string& column = {});

/// The text of a segment with these of its rows (numbers of lines, in order) and all of its comments, closed with an
/// end where its format has one. `remark` is added to the metadata. Refused: the file can no longer be read.
Result<std::string> rewritten(const LogSegment& segment, const std::vector<std::size_t>& kept,
                              const std::string& remark);

}  // namespace prism::recordings
