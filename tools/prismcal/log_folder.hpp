// SPDX-License-Identifier: MIT
// Reads the segments of a log in the order of writing and joins their rows by session, without duplicates.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/log_segment.hpp"

namespace prism::recordings {

/// Returns the paths in `folder` that end with `extension`, sorted by name; empty if the folder cannot be read.
std::vector<std::string> files_of(const std::string& folder, const std::string& extension);

/// The segments of a log or capture that a folder does not have: deleted, or never copied.
struct Absent {
  std::uint64_t segments = 0, rows = 0;  ///< before the oldest segment
  std::int64_t before_s = 0;             ///< begin of that segment (UTC)

  /// "begins with segment 4: 259200 rows before 2026-11-23T09:11:00Z are not here"; empty: nothing is absent.
  std::string text() const;
};

/// The log segments in one file or in all *.csv of a folder, in the order of their positions. Those of 0.3 and older
/// come first, in the order of the index next to them; without one, sorted by session and first second.
struct LogFolder {
  std::vector<LogSegment> segments;  ///< opened; join_rows() completes them
  std::vector<std::string> absent;   ///< Absent::text() of the logs of these segments; by open() of a folder only
  struct RejectedFile {
    std::string path;
    Error error;
  };
  std::vector<RejectedFile> rejected;  ///< files that open_log_segment() cannot open
  bool salvaging = false;              ///< by salvage(): a failed disk is damage, not an error

  /// `axis`: selects one of several axes; empty: the only one. `column`: see open_log_segment(). Errors: those of
  /// open_log_segment() if no file can be read, no .csv file, logs of several instances or gyros, an unknown axis,
  /// several axes without a selection. Damaged rows and files are left out (LeftOut::damaged).
  static Result<LogFolder> open(const std::string& path, const std::string& axis = {}, const std::string& column = {});
  /// Opens all that can be read. For verify.
  static LogFolder salvage(const std::string& path);
  /// Errors: the segments are of several instances or gyros.
  Result<void> of_one_gyro(const std::string& path) const;
  /// Returns the names of the axes, sorted.
  std::vector<std::string> axes() const;
  /// Returns one LogFolder per axis. Segments without an axis belong to the only axis, or form their own folder.
  std::vector<LogFolder> by_axis() const;
  std::uint64_t bytes() const;  ///< size of all segments
  /// Estimate of the number of rows, mostly too high.
  std::size_t most_rows() const { return bytes() / 100; }

 private:
  Result<void> choose(const std::string& axis, const std::string& path);
};

/// LeftOutRow::why of superseded rows.
inline constexpr const char* kRepeatedLater = "repeated in a later segment";
/// The same of duplicates.
inline constexpr const char* kNotLater = "repeats a second or goes back in its session";

/// Rows and files that join_rows() leaves out, and seconds that readers do not use.
struct LeftOut {
  std::vector<LeftOutRow> rows;        ///< duplicate and superseded rows, and duplicate files
  std::uint64_t duplicates = 0;        ///< rows with an earlier second of their session, or the same again
  std::uint64_t superseded = 0;        ///< rows repeated in a later segment after a disk error
  std::uint64_t partial = 0;           ///< partial seconds at the start or end of a session: their rows are kept
  std::uint64_t implausible = 0;       ///< seconds with implausible values: their rows are kept but not used
  std::uint64_t clocks_differ = 0;     ///< seconds whose frames arrived at another rate than described: as implausible
  std::uint64_t copies = 0;            ///< files that are identical to another one
  std::vector<std::string> truncated;  ///< segments without an end line
  std::uint64_t truncated_bytes = 0;
  std::vector<std::string> damaged;  ///< per damaged file: its first damaged row, and how many are left out
  std::vector<std::string> changed;  ///< files that do not match their end line; their rows are used

  /// Returns readable lines, one per reason.
  std::vector<std::string> lines() const;
};

/// Called with each row of a log, and true for the first row of a session. Seconds increase within a session.
using OnLogRow = std::function<Result<void>(const LogRow& row, bool begins_session)>;

/// Reads the rows of all segments, as a stream, and joins them. Format 1 has no session names: a second that is not
/// after the previous one starts a new session. If it is the same second, both rows are partial. Errors: those of
/// `on_row`, and a failed disk (unless folder.salvaging).
Result<LeftOut> join_rows(LogFolder& folder, const OnLogRow& on_row);

}  // namespace prism::recordings
