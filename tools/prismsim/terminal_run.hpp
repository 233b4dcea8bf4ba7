// SPDX-License-Identifier: MIT
// The simulated gyro on a pseudo-terminal, in real, multiplied or the reader's own time.
#pragma once

#include "base/result.hpp"
#include "tools/prismsim/options.hpp"
#include "tools/prismsim/pseudo_terminal.hpp"

namespace prism::prismsim {

/// Sends until the run or the program ends. A frame is due when its interval ends, counted from the start, so that
/// delays do not add up; a reader that is too slow holds the gyro up. While nobody reads, a paced gyro goes on and its
/// frames are lost, as on a real line; at "max" it waits. At the end of the run the reader gets the time to take the
/// rest.
Result<simulation::SimulationCounters> run_terminal(const SimOptions& options, PseudoTerminal& terminal);

}  // namespace prism::prismsim
