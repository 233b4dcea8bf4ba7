// SPDX-License-Identifier: MIT
// `prismctl watch` on a terminal: the loop between prismd, the keyboard and the screen.
#pragma once

#include <string>

namespace prism::screen {

/// `axis`: of several the one whose curves are drawn first; empty: the first. Until `q` or a signal; waits for prismd
/// to come back where it goes. Returns the exit code.
int watch_screen(const std::string& socket, const std::string& axis);

}  // namespace prism::screen
