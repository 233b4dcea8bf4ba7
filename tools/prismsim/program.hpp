// SPDX-License-Identifier: MIT
// prismsim as its command line asks for it.
#pragma once

namespace prism::prismsim {

/// Does what prismsim's command line says. 0: done; 1: failed; 64: not understood.
int run(int argc, char** argv);

}  // namespace prism::prismsim
