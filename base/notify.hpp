// SPDX-License-Identifier: MIT
// Notifications to systemd and the socket it passes. Without systemd the calls have no effect.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace prism {

void notify_ready(const std::string& status);
void notify_reloading();
void notify_stopping();
void notify_status(const std::string& status);
void notify_watchdog();
/// Half of systemd's watchdog interval, µs; 0 without a watchdog.
std::uint64_t watchdog_half_us();
/// The one listening Unix socket that systemd passed, if any.
std::optional<int> inherited_socket();

}  // namespace prism
