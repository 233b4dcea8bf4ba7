// SPDX-License-Identifier: MIT
// What systemd is told, and what it hands over; without systemd every call is harmless.
#pragma once

#include <cstdint>
#include <string>

namespace prism {

void notify_ready(const std::string& status);
void notify_reloading();
void notify_stopping();
void notify_status(const std::string& status);
void notify_watchdog();
/// Half of the time within which systemd wants to hear from the watchdog, µs; 0: it does not.
std::uint64_t watchdog_half_us();
/// The one listening unix socket that systemd passed; −1 where there is none.
int inherited_socket();

}  // namespace prism
