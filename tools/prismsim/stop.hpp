// SPDX-License-Identifier: MIT
// Stop request: SIGINT, SIGTERM and SIGHUP set a flag.
#pragma once

namespace prism::prismsim {

/// Installs the handlers: these signals interrupt waiting calls and set the flag instead of ending the program.
void catch_stop_signals();
bool stop_requested();

}  // namespace prism::prismsim
