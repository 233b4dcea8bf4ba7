// SPDX-License-Identifier: MIT
#include "daemon/arrival_clock.hpp"

#include <cstdlib>

namespace prism::daemon {
namespace {

template <class Clock>
std::int64_t read_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
}

constexpr std::int64_t kFollowNs = 500'000'000;

}  // namespace

std::int64_t host_time_ns() { return read_ns<std::chrono::system_clock>(); }

void ArrivalClock::begin() {
  offset_ns_ = read_ns<std::chrono::system_clock>() - read_ns<std::chrono::steady_clock>();
  last_ns_ = 0;
}

std::int64_t ArrivalClock::check() {
  ArrivalClock now;
  const std::int64_t step = now.offset_ns_ - offset_ns_;
  if (std::abs(step) <= kFollowNs) return 0;
  *this = now;
  return step;
}

}  // namespace prism::daemon
