// SPDX-License-Identifier: MIT
// Runs the relay: threads of the loops, status reports, and the end by a signal.
#pragma once

#include "tools/prismrelay/settings.hpp"

namespace prism::prismrelay {

/// Runs until SIGTERM or SIGINT. Returns the exit code.
int run_service(const Settings& settings);

/// prismrelay's main.
int run(int argc, char** argv);

}  // namespace prism::prismrelay
