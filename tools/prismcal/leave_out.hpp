// SPDX-License-Identifier: MIT
// Times of a recording that are not used (--leave-out).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::recordings {

/// The end of a second as in remarks and as --leave-out reads it: "2026-11-23T09:11:00Z", or "7001 s" without a date.
std::string end_of_second(std::int64_t second, bool is_date);

/// The range of --leave-out that leaves out exactly the seconds `first` to `last`: "7001..7031", or of dates.
std::string leave_out_range(std::int64_t first, std::int64_t last, bool is_date);

/// Ranges "FROM..TO" of times. A time is a date (ISO 8601, UTC without a zone) or a number of seconds: of the table's
/// time, or for recordings with dates since 1970, below 1e8 since the recording's start. An empty end is open.
class LeaveOut {
 public:
  explicit LeaveOut(const std::vector<std::string>& ranges);

  /// Call before contains(), with the first second of the recording; later calls have no effect. Errors: a text that is
  /// not a range, or one that ends before it begins; a date, but the times have none.
  Result<void> begin(std::int64_t first_second, bool is_date);
  /// Returns true if a part of the second (second, second + 1] is in a range, and counts it once. Call in order of
  /// time.
  bool contains(std::int64_t second);
  /// One line per range: the seconds that it left out.
  std::vector<std::string> notes() const;
  /// Texts of the ranges that contain no second of the recording.
  std::vector<std::string> unmatched() const;

 private:
  struct Range {
    std::string text;
    double from_s = 0, to_s = 0;  ///< set by begin()
    std::size_t seconds = 0;
  };

  std::vector<Range> ranges_;
  bool begun_ = false;
  std::optional<std::int64_t> last_;
};

}  // namespace prism::recordings
