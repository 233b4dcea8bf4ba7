// SPDX-License-Identifier: MIT
#include "daemon/log/retention.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/plain_text.hpp"

namespace prism::log {
namespace {

constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
constexpr double kMaxWait_s = 1e11;  // above: not worth announcing
constexpr double kMiB = 1 << 20;

std::int64_t wait_for_bytes(const Stored& stored, std::int64_t limit) {
  if (stored.all_bytes > limit) return 0;
  const double wait =
      stored.bytes_per_s > 0 ? static_cast<double>(limit - stored.all_bytes) / stored.bytes_per_s : 1e12;
  return wait < kMaxWait_s ? static_cast<std::int64_t>(wait) + 1 : kNever;
}

}  // namespace

NextDeletion next_deletion(const config::LogSegmentSettings& settings, const Stored& stored) {
  const std::int64_t by_bytes_s = wait_for_bytes(stored, settings.keep_bytes);
  const std::int64_t by_age_s = std::max<std::int64_t>(settings.keep_days * kDay_s - stored.age_s, 0);
  NextDeletion next;
  next.file = stored.file;
  next.rows = stored.rows;
  next.bytes = stored.bytes;
  next.why = by_bytes_s <= by_age_s ? NextDeletion::Why::kBytes : NextDeletion::Why::kAge;
  next.in_s = std::min(by_bytes_s, by_age_s);
  return next;
}

std::string segment_text(const std::string& file, std::uint64_t rows, std::int64_t bytes) {
  return fmt::format("{} ({}{:.1f} MiB)", file, rows > 0 ? counted(rows, "row") + ", " : "",
                     static_cast<double>(bytes) / kMiB);
}

std::string reason_text(const config::LogSegmentSettings& settings, NextDeletion::Why why, const std::string& section) {
  switch (why) {
    case NextDeletion::Why::kBytes:
      return fmt::format("more than {:.1f} MiB ({}/keep_mib)", static_cast<double>(settings.keep_bytes) / kMiB,
                         section);
    case NextDeletion::Why::kAge:
      return fmt::format("written more than {} ago, as prismd measured ({}/keep_days)",
                         counted(static_cast<std::uint64_t>(settings.keep_days), "day"), section);
    case NextDeletion::Why::kDiskFull:
      break;
  }
  return fmt::format("the disk is full ({}/when_full)", section);
}

}  // namespace prism::log
