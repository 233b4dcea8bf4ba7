// SPDX-License-Identifier: MIT
// prismcal predict: a model over the rows of a table.
#pragma once

#include <CLI/App.hpp>

namespace prism::commands {

/// Adds the subcommand; its exit code goes to `code` when it runs (0 done, 1 failed).
void add_predict_command(CLI::App& app, int& code);

}  // namespace prism::commands
