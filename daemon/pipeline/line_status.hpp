// SPDX-License-Identifier: MIT
// State of a serial line, independent of its data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/poller.hpp"
#include "drivers/transport/transport.hpp"

namespace prism::pipeline {

enum class LineState { kNone, kConnecting, kReceiving, kSilent, kReplaying, kEnded };

struct LineStatus {
  LineState state = LineState::kNone;
  std::string detail;                               ///< reason, human-readable
  std::int64_t since_ns = 0;                        ///< host time of the last change of state
  std::int64_t last_data_ns = 0;                    ///< arrival of the last bytes; 0: none since the start
  std::optional<transport::LineCounters> hardware;  ///< nullopt if the driver does not count
  std::vector<std::string> notes;                   ///< settings that the device did not accept at open
  std::string turned_away;                          ///< a host that a line that listens turns away now; empty: none
  drivers::PollCounters polls;                      ///< since the start

  /// True if the line delivers rows, so that the latest values are current.
  bool delivers() const { return state == LineState::kReceiving || state == LineState::kReplaying; }
  void set(LineState now, const std::string& why, std::int64_t now_ns) {
    if (now != state) since_ns = now_ns;
    state = now;
    detail = why;
  }
};

}  // namespace prism::pipeline
