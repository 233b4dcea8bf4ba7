// SPDX-License-Identifier: MIT
// This machine's clock.
#pragma once

#include <time.h>

#include <chrono>
#include <cstdint>

namespace prism {

/// UTC, ns since 1970.
inline std::int64_t host_time_ns() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// The same in seconds.
inline double host_time_s() { return static_cast<double>(host_time_ns()) * 1e-9; }

/// Seconds since this machine was started, with the time it was suspended. Setting the clock does not change it.
inline std::int64_t uptime_s() {
  timespec now{};
  ::clock_gettime(CLOCK_BOOTTIME, &now);
  return now.tv_sec;
}

}  // namespace prism
