// SPDX-License-Identifier: MIT
// One output of a device: the state of its line.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "compensation/sample.hpp"
#include "daemon/pipeline/line_status.hpp"

namespace prism::pipeline {

struct OutputStatus {
  static constexpr std::size_t kLatencies = 4096;

  LineState state = LineState::kNone;
  std::string detail;
  std::int64_t since_ns = 0;
  std::uint64_t bytes = 0;       ///< written since the start
  std::uint64_t lost_bytes = 0;  ///< not written: the line was closed, or its reader too slow
  std::vector<float> latencies;  ///< of the latest writes, s: from the read of a frame's last byte; a ring
  std::size_t next = 0;

  void add_latency(double seconds) {
    if (latencies.size() < kLatencies) latencies.resize(latencies.size() + 1);
    next %= kLatencies;
    latencies[next++] = static_cast<float>(seconds);
  }
  /// `share` 0 to 1; kUnknown: no write yet.
  double latency_s(double share) const {
    if (latencies.empty()) return kUnknown;
    std::vector<float> sorted = latencies;
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), at, sorted.end());
    return *at;
  }
};

}  // namespace prism::pipeline
