// SPDX-License-Identifier: MIT
// Asked to end: SIGINT, SIGTERM and SIGHUP become a flag.
#pragma once

namespace prism::prismsim {

/// From now on these signals interrupt waiting calls and raise the flag instead of ending the program.
void catch_stop_signals();
bool stop_requested();

}  // namespace prism::prismsim
