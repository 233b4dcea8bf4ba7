// SPDX-License-Identifier: MIT
// prismcal report: the paper's whole experiment on two recordings of one profile and any others.
#pragma once

#include <CLI/App.hpp>

namespace prism::commands {

/// Adds the subcommand; its exit code goes to `code` when it runs (0 done, 1 failed).
void add_report_command(CLI::App& app, int& code);

}  // namespace prism::commands
