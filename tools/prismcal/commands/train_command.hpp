// SPDX-License-Identifier: MIT
// prismcal train: a model from recordings, ready for prismd.
#pragma once

#include <CLI/App.hpp>

namespace prism::commands {

/// Adds the subcommand; its exit code goes to `code` when it runs (0 done, 1 failed).
void add_train_command(CLI::App& app, int& code);

}  // namespace prism::commands
