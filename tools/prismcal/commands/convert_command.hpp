// SPDX-License-Identifier: MIT
// prismcal convert: a recording as a capture, so that prismd can replay what never came over its line.
#pragma once

#include <CLI/App.hpp>

namespace prism::commands {

/// Adds the subcommand; its exit code goes to `code` when it runs (0 done, 1 failed).
void add_convert_command(CLI::App& app, int& code);

}  // namespace prism::commands
