// SPDX-License-Identifier: MIT
#include "tools/prismweb/recent.hpp"

#include <algorithm>

namespace prism::prismweb {
namespace {

constexpr std::int64_t kClockReset_s = 60;
constexpr std::size_t kSlack = 600;  // extra seconds, so that not every insertion moves all

}  // namespace

void RecentSeconds::put(const PeriodSummary& second) {
  if (!seconds_.empty() && second.begin_s <= last_s() - kLength_s) return;
  if (now_s_ && second.begin_s > *now_s_) return;
  const auto before = [](const PeriodSummary& one, std::int64_t begin_s) { return one.begin_s < begin_s; };
  const auto at = std::lower_bound(seconds_.begin(), seconds_.end(), second.begin_s, before);
  if (at != seconds_.end() && at->begin_s == second.begin_s) {
    *at = second;
  } else {
    seconds_.insert(at, second);
  }
  if (seconds_.size() < kLength_s + kSlack) return;
  const auto kept = std::lower_bound(seconds_.begin(), seconds_.end(), last_s() - kLength_s + 1, before);
  seconds_.erase(seconds_.begin(), kept);
}

void RecentSeconds::put_now(const PeriodSummary& second) {
  if (!seconds_.empty() && second.begin_s < last_s() - kClockReset_s) seconds_.clear();
  now_s_ = second.begin_s;
  put(second);
}

}  // namespace prism::prismweb
