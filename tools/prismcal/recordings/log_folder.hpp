// SPDX-License-Identifier: MIT
// The segments of a log in the order in which they were written, and their rows, each once, by session.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compensation/result.hpp"
#include "tools/prismcal/recordings/log_segment.hpp"

namespace prism::recordings {

/// Of a file, or of every *.csv in a folder. In order: by the index that prismd keeps beside them; those it does not
/// know (of version 0.1, or without an index) before them, by session and first second.
struct LogFolder {
  std::vector<LogSegment> segments;
  std::vector<std::string> indexes;  ///< files of the index that were read

  /// Refused: what read_log_segment refuses, a folder without a .csv file, the logs of two instances or of two gyros.
  static Result<LogFolder> read(const std::string& path, const std::string& column = {});
};

/// A row that does not count, or a whole file of them (line 0).
struct LeftOutRow {
  std::string path;
  std::size_t line = 0;
  std::string why;
};

/// What the readers of a log leave out of it.
struct LeftOut {
  std::vector<LeftOutRow> rows;  ///< doubled and superseded ones, and copies
  std::uint64_t doubled = 0;     ///< rows of a second that stood before, in the same session
  std::uint64_t superseded = 0;  ///< rows that stand again in a later segment, after a disk could not be trusted
  std::uint64_t cut = 0;         ///< seconds that a session's end or beginning cut: their rows stay, marked partial
  std::size_t copies = 0;        ///< files that are the same as another one
  std::size_t torn_segments = 0;
  std::uint64_t torn_bytes = 0;
  std::vector<std::string> changed;  ///< files whose sum does not hold; their rows are taken

  /// For people; nothing where nothing was left out.
  std::vector<std::string> lines() const;
};

struct LogRows {
  std::vector<LogRow> rows;           ///< in order; within a session seconds only go forward
  std::vector<std::size_t> sessions;  ///< where each session begins in `rows`
  LeftOut left_out;
};

/// Joins the rows. Format 1 names no session: one begins there where a second does not come after the one before it;
/// where it is the same second, both rows are of a part of it.
LogRows join_rows(const LogFolder& folder);

}  // namespace prism::recordings
