// SPDX-License-Identifier: MIT
#include "base/notify.hpp"

#include <sys/socket.h>
#include <systemd/sd-daemon.h>
#include <time.h>

#include "base/escape.hpp"

namespace prism {

void notify_ready(const std::string& status) { sd_notify(0, ("READY=1\nSTATUS=" + printable(status)).c_str()); }

// systemd 252 (Debian 12) has no Type=notify-reload: the unit has Type=notify; systemd 253 and later accept it, too.
void notify_reloading() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  const auto us = static_cast<std::uint64_t>(now.tv_sec) * 1'000'000 + static_cast<std::uint64_t>(now.tv_nsec) / 1000;
  sd_notify(0, ("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(us)).c_str());
}

void notify_stopping() { sd_notify(0, "STOPPING=1"); }
void notify_status(const std::string& status) { sd_notify(0, ("STATUS=" + printable(status)).c_str()); }
void notify_watchdog() { sd_notify(0, "WATCHDOG=1"); }

std::uint64_t watchdog_half_us() {
  std::uint64_t period = 0;
  return sd_watchdog_enabled(0, &period) > 0 ? period / 2 : 0;
}

std::optional<int> inherited_socket() {
  constexpr int kFirst = SD_LISTEN_FDS_START;
  if (sd_listen_fds(1) < 1 || sd_is_socket(kFirst, AF_UNIX, SOCK_STREAM, 1) <= 0) return std::nullopt;
  return kFirst;
}

}  // namespace prism
