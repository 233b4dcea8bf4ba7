// SPDX-License-Identifier: MIT
// The relay: one loop that follows every gyro of the host. The database has its own thread.
#pragma once

#include "tools/prismrelay/settings.hpp"

namespace prism::prismrelay {

/// Runs until SIGTERM or SIGINT.
void run_relay(const Settings& settings);

}  // namespace prism::prismrelay
