// SPDX-License-Identifier: MIT
// `prismctl watch` on a terminal: event loop of prismd, keyboard and screen.
#pragma once

#include <string>

namespace prism::screen {

/// `axis`: axis of the charts at the start; empty: the first. Runs until `q` or a signal; reconnects if prismd
/// disconnects. Returns the exit code.
int watch_screen(const std::string& socket, const std::string& axis);

}  // namespace prism::screen
