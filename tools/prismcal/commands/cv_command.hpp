// SPDX-License-Identifier: MIT
// prismcal cv: held-out errors of an LSSVM on a plain table, fold by fold.
#pragma once

#include <CLI/App.hpp>

namespace prism::commands {

/// Adds the subcommand; its exit code goes to `code` when it runs (0 done, 1 failed).
void add_cv_command(CLI::App& app, int& code);

}  // namespace prism::commands
