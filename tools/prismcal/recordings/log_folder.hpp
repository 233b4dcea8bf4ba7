// SPDX-License-Identifier: MIT
// The segments of a log in the order in which they were written, and their rows, each once, by session.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/recordings/log_segment.hpp"

namespace prism::recordings {

/// Paths of what in a folder ends in `extension`, by name; none where the folder cannot be read.
std::vector<std::string> files_of(const std::string& folder, const std::string& extension);

/// Of a file, or of every *.csv in a folder. In order: by the index that prismd keeps beside them; those it does not
/// know (of version 0.1, or without an index) before them, by session and first second.
struct LogFolder {
  std::vector<LogSegment> segments;
  std::vector<std::string> indexes;  ///< files of the index that were read
  struct RejectedFile {
    std::string path;
    Error error;
  };
  std::vector<RejectedFile> refused;  ///< files that read_log_segment refuses

  /// `axis`: the one that is wanted, where the folder holds the logs of several; empty: the only one. Refused: what
  /// read_log_segment refuses, damaged rows within, a folder without a .csv file, the logs of two instances or of two
  /// gyros, an axis that is not there, several axes without a choice.
  static Result<LogFolder> read(const std::string& path, const std::string& axis = {}, const std::string& column = {});
  /// What can be read, for those who look for faults.
  static LogFolder salvage(const std::string& path, const std::string& column = {});
  /// Refused: its segments are of two instances or of two gyros.
  Result<void> of_one_gyro(const std::string& path) const;
  /// Axes that its segments name, in order.
  std::vector<std::string> axes() const;
  /// One folder for each axis. Segments that name none stand with the only axis there is, or by themselves.
  std::vector<LogFolder> by_axis() const;

 private:
  Result<void> choose(const std::string& axis, const std::string& path);
};

/// Why a superseded row is left out.
inline constexpr const char* kWrittenAgain = "stands again in a later segment";

/// What the readers of a log leave out of it.
struct LeftOut {
  std::vector<LeftOutRow> rows;   ///< doubled and superseded ones, and copies
  std::uint64_t doubled = 0;      ///< rows of a second that stood before, in the same session, or that go back in it
  std::uint64_t superseded = 0;   ///< rows that stand again in a later segment, after a disk could not be trusted
  std::uint64_t cut = 0;          ///< seconds that a session's end or beginning cut: their rows stay, marked partial
  std::uint64_t implausible = 0;  ///< seconds that hold what was not believed: their rows stay, and nothing is taken
  std::size_t copies = 0;         ///< files that are the same as another one
  std::size_t truncated_segments = 0;
  std::uint64_t truncated_bytes = 0;
  std::vector<std::string> changed;  ///< files whose sum does not hold; their rows are taken

  /// For people; nothing where nothing was left out.
  std::vector<std::string> lines() const;
};

struct LogTable {
  std::vector<LogRow> rows;           ///< in order; within a session seconds only go forward
  std::vector<std::size_t> sessions;  ///< where each session begins in `rows`
  LeftOut left_out;
};

/// Joins the rows. Format 1 names no session: one begins there where a second does not come after the one before it;
/// where it is the same second, both rows are of a part of it.
LogTable join_rows(const LogFolder& folder);

}  // namespace prism::recordings
