// SPDX-License-Identifier: MIT
// prismcal evaluate: how good one model is on recordings, with limits and a report.
#pragma once

#include <CLI/App.hpp>

namespace prism::commands {

/// Adds the subcommand; its exit code goes to `code` when it runs (0 done, 1 failed or a limit not kept).
void add_evaluate_command(CLI::App& app, int& code);

}  // namespace prism::commands
