// SPDX-License-Identifier: MIT
// The last two hours of an axis, second by second, in memory.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tools/prismweb/period_summary.hpp"

namespace prism::prismweb {

class RecentSeconds {
 public:
  static constexpr std::int64_t kLength_s = 7200;

  /// Puts a second at its place in time; one that is there already is replaced, one that is too old is left out.
  void put(const PeriodSummary& second);
  /// One that has just happened. Where its time is a minute and more before the last one, a clock began anew: what was
  /// before it is forgotten.
  void put_now(const PeriodSummary& second);

  bool empty() const { return seconds_.empty(); }
  std::int64_t first_s() const { return seconds_.front().begin_s; }
  std::int64_t last_s() const { return seconds_.back().begin_s; }
  const std::vector<PeriodSummary>& all() const { return seconds_; }

 private:
  std::vector<PeriodSummary> seconds_;  ///< in the order of time
};

}  // namespace prism::prismweb
