// SPDX-License-Identifier: MIT
// The commands of prismctl: one question each, and the live screen.
#pragma once

namespace prism::prismctl {

/// Does what the command line says. 0: done; 1: no answer, or a refusal; 64: not understood.
int run(int argc, char** argv);

}  // namespace prism::prismctl
