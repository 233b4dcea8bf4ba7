// SPDX-License-Identifier: MIT
// prismweb as its command line asks for it.
#pragma once

namespace prism::prismweb {

/// Does what the command line says. Returns the exit code.
int run(int argc, char** argv);

}  // namespace prism::prismweb
