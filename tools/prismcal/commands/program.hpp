// SPDX-License-Identifier: MIT
// The command line of prismcal.
#pragma once

namespace prism::commands {

/// Runs the command line. Returns the exit code: 0 done, 1 failed or a limit violated, 64 wrong usage, 130 interrupted.
int run(int argc, char** argv);

}  // namespace prism::commands
