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
#include "daemon/pipeline/log_writers.hpp"

namespace prism::log {

using pipeline::RowCursor, pipeline::RowPage, pipeline::RowQuery, pipeline::RowRefusal, pipeline::RowResult;

/// The synced part of the open segment.
struct OpenSegment {
  std::string path;  ///< empty: no segment is open
  std::uint64_t rows = 0;
};

/// Used on the disk thread, like the log that it reads. Returns synced rows only. Rows that were written again are
/// returned from the new segment only. Rows that the index lists and the file does not have are counted as missing, and
/// reported once per segment: a file that was cut short stops no client.
class LogPager {
 public:
  static constexpr std::size_t kMostBytes = 256 << 10;  ///< max. size of the rows of a page

  explicit LogPager(Segments& segments) : segments_(segments) {}

  /// Errors: an invalid cursor, a cursor of another log or past the end of this one, a segment that cannot be opened.
  RowResult page(const RowQuery& query, const OpenSegment& open);

  /// A segment and the position of its rows in the log.
  struct Part {
    NumberedSegment segment;
    std::uint64_t before = 0;  ///< rows of the log before it
    std::uint64_t end() const { return before + segment.rows; }
  };
  /// All segments that were not deleted, in order.
  std::vector<Part> parts(const OpenSegment& open);

 private:
  /// The lines above a segment's rows.
  struct Head {
    std::string columns, metadata;  ///< metadata: members of a JSON object, without braces
    std::uint64_t bytes = 0;        ///< offset of the first row
    std::string supersedes_file;
    std::uint64_t supersedes_row = 0;
  };
  struct Place {
    std::uint64_t row = 0, offset = 0;
  };
  tl::expected<RowCursor, RowRefusal> resolve(const std::string& after, const std::vector<Part>& parts,
                                              std::uint64_t first_total);
  const Head* head_of(const NumberedSegment& segment);
  void limit_superseded(std::vector<NumberedSegment>& segments);
  std::uint64_t whole_rows(const NumberedSegment& segment, const Head& head);
  /// Rows of one segment in a page.
  struct PartRows {
    std::string json;  ///< empty: no rows
    std::uint64_t rows = 0;
    std::optional<std::uint64_t> in_file;  ///< set if the file ended before `most` rows: its number of rows
    std::string why;                       ///< the disk's error that ended it, if any
  };
  /// Errors: a file that exists and cannot be opened, which may be temporary.
  tl::expected<PartRows, RowRefusal> rows_of(const NumberedSegment& segment, std::uint64_t behind, std::uint64_t most,
                                             bool with_header);
  PartRows read_rows(const NumberedSegment& segment, const Head& head, std::uint64_t behind, std::uint64_t most);
  void report_loss(const NumberedSegment& segment, const PartRows& found);

  Segments& segments_;
  std::string log_;                              ///< the log to which the following belong
  std::map<std::uint64_t, Head> heads_;          ///< by number
  std::map<std::uint64_t, std::uint64_t> torn_;  ///< rows of segments without an end line
  std::map<std::uint64_t, Place> places_;        ///< end of the last page, by segment
  std::set<std::uint64_t> reported_;             ///< segments with lost rows
  RowCursor gone_;                               ///< the last one whose next rows were deleted
};

}  // namespace prism::log
