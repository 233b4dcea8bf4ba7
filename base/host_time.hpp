// SPDX-License-Identifier: MIT
// This machine's clock.
#pragma once

#include <chrono>
#include <cstdint>

namespace prism {

/// UTC, ns since 1970.
inline std::int64_t host_time_ns() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace prism
