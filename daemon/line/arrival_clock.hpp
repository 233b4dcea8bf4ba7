// SPDX-License-Identifier: MIT
// Monotonic arrival times in UTC.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace prism::line {

/// One for all lines of an instance. now_ns() = CLOCK_MONOTONIC + an offset taken from CLOCK_REALTIME at begin(). If
/// the host clock is set during a session, only check() follows it, and only a step of more than half a second.
class ArrivalClock {
 public:
  ArrivalClock() { begin(); }

  void begin();
  /// ns since 1970 UTC. Never decreases between begin() and a step that check() follows.
  std::int64_t now_ns() const { return at(std::chrono::steady_clock::now()); }
  std::int64_t at(std::chrono::steady_clock::time_point time) const {
    return std::chrono::nanoseconds(time.time_since_epoch()).count() + offset_ns_;
  }
  /// Time stamp of bytes read at `time`: always later than the previous stamp.
  std::int64_t stamp(std::chrono::steady_clock::time_point time) { return last_ns_ = std::max(at(time), last_ns_ + 1); }
  /// Call about once a second. Returns the step in ns if the host clock was set, else 0.
  std::int64_t check();

 private:
  std::int64_t offset_ns_ = 0, last_ns_ = 0;
};

}  // namespace prism::line
