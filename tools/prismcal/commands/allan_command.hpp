// SPDX-License-Identifier: MIT
// prismcal allan: the Allan deviation of a recorded rate, and what it says about the gyro.
#pragma once

#include <CLI/App.hpp>

namespace prism::commands {

/// Adds the subcommand; its exit code goes to `code` when it runs (0 done, 1 failed).
void add_allan_command(CLI::App& app, int& code);

}  // namespace prism::commands
