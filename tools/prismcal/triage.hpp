// SPDX-License-Identifier: MIT
// Many recordings in one table: which of them can be used, and why not.
#pragma once

#include <string>
#include <vector>

#include "tools/prismcal/training_set.hpp"

namespace prism::commands {

/// Prints a line for each recording: length, step, temperatures, noise of the window's means, verdict and its first
/// reason; with `json` all reasons. Returns 1 if none can be used for training.
int triage(const std::vector<std::string>& paths, const recordings::TrainingSetOptions& options, bool json);

}  // namespace prism::commands
