// SPDX-License-Identifier: MIT
// Status of retention: limits, deletions so far, and the next one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace prism::pipeline {

/// The segment that retention deletes next.
struct NextDeletion {
  enum class Why { kBytes, kAge, kDiskFull };

  std::string file;
  std::uint64_t rows = 0;  ///< 0: not known
  std::int64_t bytes = 0;
  Why why = Why::kBytes;
  std::int64_t in_s = 0;  ///< time until then, expected
};

/// Of one log or capture.
struct RetentionStatus {
  std::uint64_t segments = 0;  ///< files, with the open one
  std::int64_t bytes = 0;
  std::int64_t keep_bytes = 0, keep_s = 0;               ///< the configured limits
  std::uint64_t deleted_segments = 0, deleted_rows = 0;  ///< since the log began
  std::optional<NextDeletion> next;                      ///< nullopt: there is no segment to delete
  std::int64_t uptime_s = 0;                             ///< uptime_s() when this was computed
};

}  // namespace prism::pipeline
