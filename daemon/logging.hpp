// SPDX-License-Identifier: MIT
// What prismd says on stderr.
#pragma once

#include <string>

#include "daemon/socket/event_log.hpp"

namespace prism::daemon {

/// Messages of `level` (spdlog's name of it) and above. Under systemd the journal has its own times and takes the
/// severity from a prefix, "<4>".
void begin_logging(const std::string& level);

/// An event as a line.
void log_event(const socket::Event& event);

/// Waits half a second at most until every message is written.
void finish_logging();

}  // namespace prism::daemon
