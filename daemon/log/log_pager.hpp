// SPDX-License-Identifier: MIT
// Reads a log page by page, from a cursor. Missing rows are counted.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "daemon/log/segments.hpp"
#include "daemon/pipeline/interfaces.hpp"

namespace prism::log {

using pipeline::RowCursor, pipeline::RowPage, pipeline::RowQuery, pipeline::RowRefusal, pipeline::RowResult;

/// Used on the disk thread, like the log that it reads. Returns synced rows only, each from the last segment that has
/// its number. Rows that a file should have and does not are counted as missing, and reported once per segment: a file
/// that was cut short stops no client.
class LogPager {
 public:
  static constexpr std::size_t kMostBytes = 256 << 10;  ///< max. size of the rows of a page

  explicit LogPager(Segments& segments) : segments_(segments) {}

  /// `synced`: rows of the open segment on the disk. Errors: an invalid cursor, a cursor of another log, past the end
  /// of this one or whose next rows were deleted, a segment that cannot be opened.
  RowResult page(const RowQuery& query, std::uint64_t synced);

 private:
  /// A segment and the numbers of its rows: above `before`, up to `end`.
  struct Part {
    const StoredSegment* segment = nullptr;
    bool is_readable = false;  ///< false: its position is damaged
    std::uint64_t before = 0, end = 0;
  };
  /// The lines above a segment's rows.
  struct Head {
    std::string lines, columns;  ///< lines: "# KEY: VALUE"
    std::uint64_t bytes = 0;     ///< offset of the first row
  };
  struct Place {
    std::uint64_t row = 0, offset = 0;
  };
  /// Rows of one segment in a page.
  struct PartRows {
    std::string json;  ///< empty: no rows
    std::uint64_t rows = 0;
    std::optional<std::uint64_t> in_file;  ///< set if the file ended before `most` rows: its number of rows
    std::string why;                       ///< the disk's error that ended it, if any
  };
  std::vector<Part> parts(std::uint64_t after, std::uint64_t end);
  tl::expected<RowCursor, RowRefusal> resolve(const std::string& after, std::uint64_t end);
  static std::optional<Head> head_of(const StoredSegment& segment);
  /// Errors: a file that exists and cannot be opened, which may be temporary.
  tl::expected<PartRows, RowRefusal> rows_of(const Part& part, std::uint64_t behind, std::uint64_t most,
                                             bool with_header);
  PartRows read_rows(const StoredSegment& segment, std::uint64_t begin, std::uint64_t behind, std::uint64_t most);
  void report_loss(const Part& part, const PartRows& found);

  Segments& segments_;
  std::map<std::uint64_t, Place> places_;  ///< end of the last page, by number
  std::set<std::uint64_t> reported_;       ///< segments with lost rows
};

}  // namespace prism::log
