// SPDX-License-Identifier: MIT
// Files in segments: their names, when the next one begins, and which old ones go.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compensation/result.hpp"
#include "config/config.hpp"

namespace prism::daemon {

/// Decides by data time only, so that a replay cuts its segments where the live run did.
class SegmentClock {
 public:
  explicit SegmentClock(const config::SegmentSettings& settings) : settings_(settings) {}

  /// True where data of `second` that bring the segment to `bytes` belong into a new one. The first call begins one.
  bool begins_new(std::int64_t second, std::int64_t bytes);

 private:
  config::SegmentSettings settings_;
  std::int64_t period_ = INT64_MIN;
};

/// DIRECTORY/NAME-20261121T091100Z.EXTENSION; with "-2", "-3", … before the extension where that file exists.
std::string segment_path(const config::SegmentSettings& settings, const std::string& name, const std::string& extension,
                         std::int64_t second);

/// Makes the folder of the segments (and its parents).
Result<void> make_segment_folder(const config::SegmentSettings& settings);

/// Deletes the oldest segments of NAME beyond keep_bytes and keep_days (against `second`), never the one at `current`.
/// Returns the names deleted.
std::vector<std::string> delete_old_segments(const config::SegmentSettings& settings, const std::string& name,
                                             const std::string& extension, const std::string& current,
                                             std::int64_t second);

/// Deletes the single oldest segment but `current`, to make room. False where there is none.
bool delete_oldest_segment(const config::SegmentSettings& settings, const std::string& name,
                           const std::string& extension, const std::string& current);

}  // namespace prism::daemon
