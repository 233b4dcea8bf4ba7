// SPDX-License-Identifier: MIT
// Runs prismsim as the command line requests.
#pragma once

namespace prism::prismsim {

/// Runs the simulation. Returns 0: done; 1: failed; 64: invalid command line.
int run(int argc, char** argv);

}  // namespace prism::prismsim
