// SPDX-License-Identifier: MIT
// Rules of retention: which segment is deleted next, when and why. Computes only.
#pragma once

#include <cstdint>
#include <string>

#include "config/config.hpp"
#include "daemon/pipeline/retention_status.hpp"

namespace prism::log {

using pipeline::NextDeletion;

inline constexpr std::int64_t kDay_s = 86400;

/// Input of next_deletion().
struct Stored {
  std::string file;            ///< the oldest segment that may be deleted
  std::uint64_t rows = 0;      ///< its rows; 0: not known
  std::int64_t bytes = 0;      ///< of the file
  std::int64_t age_s = 0;      ///< time that prismd measured since it wrote the segment
  std::int64_t all_bytes = 0;  ///< of all segments
  double bytes_per_s = 0;      ///< growth of all segments; 0: not known
};

/// The limits are those of `settings`: keep_bytes and keep_days.
NextDeletion next_deletion(const config::LogSegmentSettings& settings, const Stored& stored);

/// "gyro-….csv (86400 rows, 16.4 MiB)"
std::string segment_text(const std::string& file, std::uint64_t rows, std::int64_t bytes);

/// The limit that `next` exceeds: "more than 10240.0 MiB (log/keep_mib)". `section`: log or capture.
std::string reason_text(const config::LogSegmentSettings& settings, NextDeletion::Why why, const std::string& section);

}  // namespace prism::log
