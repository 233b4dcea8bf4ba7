// SPDX-License-Identifier: MIT
// A log's rows by their place in it: read from the segments, without a hole that is not told.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "daemon/log/segments.hpp"
#include "daemon/pipeline/log_writers.hpp"

namespace prism::log {

using pipeline::RowCursor, pipeline::RowPage, pipeline::RowQuery, pipeline::RowRefusal, pipeline::RowResult;

/// What of the segment that is being written stands on the disk.
struct OpenSegment {
  std::string path;  ///< empty: none is open
  std::uint64_t rows = 0;
};

/// Lives on the disk thread, beside the log that it reads. Rows that no sync has seen are not told, and rows that were
/// written again into another segment only there.
class LogRows {
 public:
  static constexpr std::size_t kMostBytes = 256 << 10;  ///< of rows in a page

  explicit LogRows(Segments& segments) : segments_(segments) {}

  /// Refused: a cursor of another log, one beyond the log's end, or no cursor at all.
  RowResult page(const RowQuery& query, const OpenSegment& open);

  /// A segment and the place of its rows in the log.
  struct Part {
    NumberedSegment segment;
    std::uint64_t before = 0;  ///< rows of the log in front of it
    std::uint64_t end() const { return before + segment.rows; }
  };
  /// Every segment that was not deleted, in order.
  std::vector<Part> parts(const OpenSegment& open);

 private:
  /// What stands above a segment's rows.
  struct Head {
    std::string columns, metadata;  ///< the metadata as the members of an object
    std::uint64_t bytes = 0;        ///< where the rows begin
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
  std::uint64_t append_rows(const NumberedSegment& segment, const Head& head, std::uint64_t behind, std::uint64_t most,
                            std::string& json);

  Segments& segments_;
  std::map<std::uint64_t, Head> heads_;          ///< by number
  std::map<std::uint64_t, std::uint64_t> torn_;  ///< rows of those that nobody ended
  std::map<std::uint64_t, Place> places_;        ///< where the last page of a segment ended
};

}  // namespace prism::log
