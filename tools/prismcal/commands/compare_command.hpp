// SPDX-License-Identifier: MIT
// prismcal compare: several models on several recordings in one table; the old model against the new.
#pragma once

#include <CLI/App.hpp>

namespace prism::commands {

/// Adds the subcommand; its exit code goes to `code` when it runs (0 done, 1 failed).
void add_compare_command(CLI::App& app, int& code);

}  // namespace prism::commands
