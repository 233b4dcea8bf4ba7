// SPDX-License-Identifier: MIT
// How a log or capture is divided into files: names, the position of a file in its log, and what 0.3 wrote instead
// (docs/formats.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace prism::pipeline {

// A position in a log. Clients store its text and send it back unchanged.

inline constexpr std::size_t kLogIdChars = 32;
inline const std::string kNoLog(kLogIdChars, '0');  ///< id of a log without a row yet

/// The position after a row.
struct RowCursor {
  std::string log;            ///< LogPosition::log; kNoLog: of a log without a row yet
  std::uint64_t segment = 0;  ///< its number; 0: before the first
  std::uint64_t row = 0;      ///< row in the segment, from 1; 0: before the first
  std::uint64_t total = 0;    ///< rows of the log up to here, with deleted ones; used to count missing rows

  std::string text() const;
  /// Returns nullopt if the text is invalid.
  static std::optional<RowCursor> parse(std::string_view text);

  bool operator==(const RowCursor&) const = default;
};

/// NAME-000012-20261121T091100Z.csv; a capture also has the running time: NAME-000012-20261121T091100Z-86400s.pcap.
/// prism 0.3 and older: NAME-20261121T091100Z.csv, then "-2", "-3", … before the extension.
struct SegmentName {
  std::uint64_t number = 0;    ///< from 1 in the order of creation; 0: of 0.3 or older
  std::int64_t begin_s = 0;    ///< first second (data time, UTC)
  std::uint64_t same = 1;      ///< 0.3 and older: 2 for "-2"
  std::int64_t running_s = 0;  ///< captures: as LogPosition::running_s

  /// `name`: of the log or capture; `extension`: with the dot, .pcap for a capture.
  std::string file(const std::string& name, const std::string& extension) const;
  /// Returns nullopt if `file` has another name or extension.
  static std::optional<SegmentName> parse(std::string_view file, std::string_view name, std::string_view extension);
};

/// The header line "# log: ID segment N first ROW running S".
struct LogPosition {
  std::string log;             ///< 32 hex digits, from the SHA-256 of the first segment's other header lines
  std::uint64_t segment = 0;   ///< SegmentName::number
  std::uint64_t first = 0;     ///< number of its first row in the log, from 1; deleted rows count
  std::int64_t running_s = 0;  ///< how long prismd had run on this log in all its runs, when it made the segment

  std::string line() const;
  /// `value`: the line after "# log: ". Returns nullopt if it is invalid.
  static std::optional<LogPosition> parse(std::string_view value);
};

/// The header line "# supersedes: FILE from row N": FILE's rows from N (from 1) on are in this segment, too.
struct SupersededRows {
  std::string file;
  std::uint64_t row = 0;

  /// `value`: the line after "# supersedes: ". Returns nullopt if it is invalid.
  static std::optional<SupersededRows> parse(std::string_view value);
};

/// NAME.EXTENSION.index of prism 0.2 and 0.3, which their segments need: it is only read.
struct OldIndex {
  struct Entry {
    std::string file;
    std::uint64_t rows = 0;    ///< 0: not known
    std::int64_t clock_s = 0;  ///< running time at its end
  };
  std::string id;
  std::map<std::uint64_t, Entry> entries;  ///< by number; not those that were deleted
  std::uint64_t next = 1, deleted_rows = 0;
  std::int64_t clock_s = 0;  ///< running time at the last entry

  /// Returns nullopt if it is missing or damaged. Leaves out invalid lines.
  static std::optional<OldIndex> read(const std::string& path);
};

}  // namespace prism::pipeline
