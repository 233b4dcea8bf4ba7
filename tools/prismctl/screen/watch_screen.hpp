// SPDX-License-Identifier: MIT
// `prismctl watch` on a terminal: the loop between prismd, the keyboard and the screen.
#pragma once

#include <string>

namespace prism::screen {

/// Until `q` or a signal; waits for prismd to come back where it goes. Returns the exit code.
int watch_screen(const std::string& socket);

}  // namespace prism::screen
