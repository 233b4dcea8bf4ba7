// SPDX-License-Identifier: MIT
// Log output of prismd on stderr.
#pragma once

#include <string>

#include "daemon/socket/event_log.hpp"

namespace prism::daemon {

/// Logs messages of `level` (a name of spdlog) and above. Under systemd, lines have a severity prefix ("<4>") and no
/// time, which the journal adds.
void begin_logging(const std::string& level);

/// Logs an event as one line.
void log_event(const socket::Event& event);

/// Waits at most half a second until all messages are written.
void finish_logging();

}  // namespace prism::daemon
