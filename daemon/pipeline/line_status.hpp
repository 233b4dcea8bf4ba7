// SPDX-License-Identifier: MIT
// One line of a device or an output: its state, independent of its data, and its capture.
#pragma once

#include <algorithm>
#include <boost/circular_buffer.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compensation/sample.hpp"
#include "config/config.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "drivers/commands.hpp"
#include "drivers/transport/transport.hpp"

namespace prism::pipeline {

enum class LineState { kNone, kConnecting, kReceiving, kSilent, kReplaying, kEnded };

/// Pauses before a line is opened again: retry_min_s while the device is absent, so that it is used soon after it is
/// back; for one that exists but fails, doubled up to retry_max_s.
class RetryPause {
 public:
  void reset() { next_s_ = 0; }
  std::chrono::steady_clock::duration next(const config::LineConfig& line, bool is_there) {
    const double now_s = is_there ? std::max(next_s_, line.retry_min_s) : line.retry_min_s;
    next_s_ = is_there ? std::min(2 * now_s, line.retry_max_s) : 0;
    return std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(now_s));
  }

 private:
  double next_s_ = 0;
};

struct LineStatus {
  LineState state = LineState::kNone;
  std::string detail;                               ///< reason, human-readable
  std::int64_t since_ns = 0;                        ///< host time of the last change of state
  std::int64_t last_data_ns = 0;                    ///< arrival of the last bytes; 0: none since the start
  std::optional<transport::LineCounters> hardware;  ///< nullopt if the driver does not count
  std::vector<std::string> notes;                   ///< settings that the device did not accept at open
  drivers::PollCounters polls;                      ///< since the start
  std::unique_ptr<CaptureSink> capture;             ///< null: none is configured

  /// True if the line delivers rows, so that the latest values are current.
  bool delivers() const { return state == LineState::kReceiving || state == LineState::kReplaying; }
  bool replays() const { return state == LineState::kReplaying || state == LineState::kEnded; }
  void set(LineState now, const std::string& why, std::int64_t now_ns) {
    if (now != state) since_ns = now_ns;
    state = now;
    detail = why;
  }
};

/// The line of an output; without `hardware` to `capture`.
struct OutputStatus : LineStatus {
  std::uint64_t bytes = 0;                          ///< written since the start
  std::uint64_t lost_bytes = 0;                     ///< not written: the line was closed, or its reader too slow
  boost::circular_buffer<float> latencies_s{4096};  ///< of the latest writes, from the read of a frame's last byte

  /// `share` 0 to 1; kUnknown: no write yet.
  double latency_s(double share) const {
    if (latencies_s.empty()) return kUnknown;
    std::vector<float> sorted(latencies_s.begin(), latencies_s.end());
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), at, sorted.end());
    return *at;
  }
};

}  // namespace prism::pipeline
