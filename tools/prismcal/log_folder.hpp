// SPDX-License-Identifier: MIT
// prismd's log (format 1 or 2): its segments, each checked against its end line, in the order of writing, and their
// rows joined by session, without duplicates.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/compensated_text.hpp"
#include "compensation/second_averager.hpp"
#include "daemon/pipeline/stored_segments.hpp"
#include "tools/prismcal/recording.hpp"

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

/// open_log_segment() sets the members up to first_second, read_log_segment() the others.
struct LogSegment : Metadata {
  std::string path, file;
  int format = 1;
  std::string comments;                                ///< all lines that begin with '#'
  std::string session;                                 ///< format 2; empty: none
  std::optional<pipeline::SupersededRows> superseded;  ///< rows that are repeated here
  std::optional<pipeline::LogPosition> position;       ///< nullopt: of 0.3 or older
  std::optional<compensation::CsvLayout> columns;      ///< nullopt: the segment ends before them and has no rows
  std::optional<std::size_t> requested;                ///< of them
  std::optional<std::int64_t> first_second;            ///< of the first readable row

  std::string sha256;
  std::size_t rows = 0;             ///< readable rows
  std::vector<LeftOutRow> damaged;  ///< unreadable rows before the last good row: not a truncation
  bool read_failed = false;         ///< the disk failed; the last of `damaged` has the place and the reason
  SegmentEnd end = SegmentEnd::kIntact;
  std::size_t truncated_bytes = 0;  ///< bytes after the last complete row
  std::size_t truncated_line = 0;   ///< line of the first of them
};

/// True for a log's first bytes and columns, whatever the lines between them: an extract with other columns is a table.
bool is_log(const std::string& path);

/// Reads the lines above the rows, and the first row. Rows parse `column`, if not empty, as numbers into LogRow::value
/// (an empty field is kUnknown). Errors, with file and line: not a log of prismd, a newer format, an unknown column.
Result<LogSegment> open_log_segment(const std::string& path, const std::string& column = {});

/// Called with each readable row of a segment in order.
using OnSegmentRow = std::function<Result<void>(const LogRow& row)>;

/// Reads the rows in order, in constant memory, and completes the segment. An incomplete end, as after a power failure,
/// and damaged rows are not errors but are listed. Errors: only those of `on_row`, which end the reading.
Result<void> read_log_segment(LogSegment& segment, const OnSegmentRow& on_row);

/// Returns the paths in `folder` that end with `extension`, sorted by name; empty if the folder cannot be read.
std::vector<std::string> files_of(const std::string& folder, const std::string& extension);

/// "begins with segment 4: 259200 rows before 2026-11-23T09:11:00Z are not here": the segments and rows of a log or
/// capture before `before_s` (UTC; 0: not known), which a folder does not have: deleted, or never copied. Empty: none.
std::string absent_text(std::uint64_t segments, std::uint64_t rows, std::int64_t before_s);

/// The log segments in one file or in all *.csv of a folder, in the order of their positions. Those of 0.3 and older
/// come first, in the order of the index next to them; without one, sorted by session and first second.
struct LogFolder {
  std::vector<LogSegment> segments;  ///< opened; join_rows() completes them
  std::vector<std::string> absent;   ///< absent_text() of the logs of these segments; by open() of a folder only
  std::vector<std::pair<std::string, Error>> rejected;  ///< files that open_log_segment() cannot open
  bool salvaging = false;                               ///< by salvage(): a failed disk is damage, not an error

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
};

/// LeftOutRow::why of superseded rows.
inline constexpr const char* kRepeatedLater = "repeated in a later segment";

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
/// after the previous one starts a new session. Errors: those of `on_row`, and a failed disk (unless folder.salvaging).
Result<LeftOut> join_rows(LogFolder& folder, const OnLogRow& on_row);

}  // namespace prism::recordings
