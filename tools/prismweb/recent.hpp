// SPDX-License-Identifier: MIT
// The last two hours of an axis in memory, in seconds.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tools/prismweb/period_summary.hpp"

namespace prism::prismweb {

class RecentSeconds {
 public:
  static constexpr std::int64_t kLength_s = 7200;

  /// Inserts a second of the log by time. Replaces one of the same time; ignores one that is too old, or later than the
  /// current second: it is from before a reset of the clock.
  void put(const PeriodSummary& second);
  /// Adds the current second. If it is over a minute older than the last one, the clock was reset: removes all others.
  void put_now(const PeriodSummary& second);
  /// The current second is not known: prismd was connected again.
  void forget_now() { now_s_.reset(); }

  bool empty() const { return seconds_.empty(); }
  std::int64_t first_s() const { return seconds_.front().begin_s; }
  std::int64_t last_s() const { return seconds_.back().begin_s; }
  const std::vector<PeriodSummary>& all() const { return seconds_; }

 private:
  std::vector<PeriodSummary> seconds_;  ///< in order of time
  std::optional<std::int64_t> now_s_;
};

}  // namespace prism::prismweb
