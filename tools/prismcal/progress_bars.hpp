// SPDX-License-Identifier: MIT
// Progress bars on stderr, if it is a terminal.
#pragma once

#include "compensation/training/tuning.hpp"
#include "tools/prismcal/read_meter.hpp"

namespace prism::commands {

/// Of a tuning, with the best cost so far.
training::TuningProgress progress_bar(bool quiet);

/// Of reading that takes more than 2 s, with its rate and the time left. Empty if stderr is not a terminal.
tables::ReadProgress read_progress();

/// Ends the line of a bar.
void end_progress();

}  // namespace prism::commands
