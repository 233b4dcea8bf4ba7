// SPDX-License-Identifier: MIT
// What is known of a line itself, whatever it carries.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/transport/transport.hpp"

namespace prism::pipeline {

enum class LineState { kNone, kConnecting, kReceiving, kSilent, kReplaying, kEnded };

struct LineStatus {
  LineState state = LineState::kNone;
  std::string detail;                               ///< why, for people
  std::int64_t since_ns = 0;                        ///< host time at which the state was taken
  std::int64_t last_data_ns = 0;                    ///< arrival of the last bytes; 0: none since the start
  std::optional<transport::LineCounters> hardware;  ///< nothing if the driver does not count
  std::vector<std::string> notes;                   ///< what the line could not be given when it was opened

  /// True while rows come, or came a moment ago: what was measured is of now.
  bool delivers() const { return state == LineState::kReceiving || state == LineState::kReplaying; }
  void set(LineState now, const std::string& why, std::int64_t now_ns) {
    if (now != state) since_ns = now_ns;
    state = now;
    detail = why;
  }
};

}  // namespace prism::pipeline
