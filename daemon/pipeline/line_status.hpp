// SPDX-License-Identifier: MIT
// One line of a device: its state, independent of its data, and its capture.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/log_writers.hpp"
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
  drivers::PollCounters polls;                      ///< since the start
  std::unique_ptr<CaptureSink> capture;             ///< null: none is configured

  /// True if the line delivers rows, so that the latest values are current.
  bool delivers() const { return state == LineState::kReceiving || state == LineState::kReplaying; }
  void set(LineState now, const std::string& why, std::int64_t now_ns) {
    if (now != state) since_ns = now_ns;
    state = now;
    detail = why;
  }
};

}  // namespace prism::pipeline
