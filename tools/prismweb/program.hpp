// SPDX-License-Identifier: MIT
// The program prismweb.
#pragma once

namespace prism::prismweb {

/// Runs the command line. Returns the exit code.
int run(int argc, char** argv);

}  // namespace prism::prismweb
