// SPDX-License-Identifier: MIT
// The command line of prismctl.
#pragma once

namespace prism::prismctl {

/// Runs a command. Returns 0, 1 if prismd did not respond or returned an error, or 64 for a usage error.
int run(int argc, char** argv);

}  // namespace prism::prismctl
