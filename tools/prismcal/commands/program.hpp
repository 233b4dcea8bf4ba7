// SPDX-License-Identifier: MIT
// prismcal as its command line asks for it.
#pragma once

namespace prism::commands {

/// Does what prismcal's command line says. 0: done; 1: failed, or a limit not kept; 64: not understood; 130:
/// interrupted.
int run(int argc, char** argv);

}  // namespace prism::commands
