// SPDX-License-Identifier: MIT
#include "daemon/line/arrival_clock.hpp"

#include <cstdlib>

#include "base/host_time.hpp"

namespace prism::line {
namespace {

constexpr std::int64_t kFollowNs = 500'000'000;

}  // namespace

void ArrivalClock::begin() {
  offset_ns_ = host_time_ns() - std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
  last_ns_ = 0;
}

std::int64_t ArrivalClock::check() {
  ArrivalClock now;
  const std::int64_t step = now.offset_ns_ - offset_ns_;
  if (std::abs(step) <= kFollowNs) return 0;
  *this = now;
  return step;
}

}  // namespace prism::line
