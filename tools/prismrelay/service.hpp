// SPDX-License-Identifier: MIT
// The relay as it runs: the loops on their threads, what it says of itself, and its end by a signal.
#pragma once

#include "tools/prismrelay/settings.hpp"

namespace prism::prismrelay {

/// Until SIGTERM or SIGINT; the exit code.
int run_service(const Settings& settings);

/// prismrelay's main.
int run(int argc, char** argv);

}  // namespace prism::prismrelay
