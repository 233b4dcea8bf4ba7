// SPDX-License-Identifier: MIT
// prismcal fit: a model from a plain table; any regression.
#pragma once

#include <CLI/App.hpp>

namespace prism::commands {

/// Adds the subcommand; its exit code goes to `code` when it runs (0 done, 1 failed).
void add_fit_command(CLI::App& app, int& code);

}  // namespace prism::commands
