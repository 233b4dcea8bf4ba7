// SPDX-License-Identifier: MIT
// Arrival times that never run backwards: the monotonic clock, laid on UTC.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace prism::line {

/// One for all lines of an instance. now_ns() = CLOCK_MONOTONIC + an offset taken from CLOCK_REALTIME at begin(). A
/// host clock that is set during a session is followed only in check(), and only where it is off by more than half a
/// second.
class ArrivalClock {
 public:
  ArrivalClock() { begin(); }

  void begin();
  /// ns since 1970 UTC. Never decreases between begin() and a step that check() follows.
  std::int64_t now_ns() const { return at(std::chrono::steady_clock::now()); }
  std::int64_t at(std::chrono::steady_clock::time_point time) const {
    return std::chrono::nanoseconds(time.time_since_epoch()).count() + offset_ns_;
  }
  /// The stamp of what was read at `time`: later than the stamp before.
  std::int64_t stamp(std::chrono::steady_clock::time_point time) { return last_ns_ = std::max(at(time), last_ns_ + 1); }
  /// Call each second or so. Returns the step, ns, where the host clock was set; else 0.
  std::int64_t check();

 private:
  std::int64_t offset_ns_ = 0, last_ns_ = 0;
};

}  // namespace prism::line
