// SPDX-License-Identifier: MIT
// Sends the simulated gyro to a pseudo-terminal or network line in real time, scaled time or at the reader's speed.
#pragma once

#include "base/result.hpp"
#include "tools/prismsim/options.hpp"
#include "tools/prismsim/outlet.hpp"

namespace prism::prismsim {

/// Sends until the run or the program ends. A frame is due when its interval ends, counted from the start, so that
/// delays do not accumulate; a slow reader delays the gyro. Without a reader a paced gyro continues and its frames are
/// lost, as on a real line; at "max" it waits. At the end the reader gets time to read the rest.
Result<simulation::SimulationCounters> run_terminal(const SimOptions& options, Outlet& terminal);

}  // namespace prism::prismsim
