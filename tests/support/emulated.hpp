// SPDX-License-Identifier: MIT
// Skips tests that an emulator cannot run: qemu-user has no termios2, which opening a line needs, and its timing is not
// that of a processor.
#pragma once

#include <cstdlib>

namespace prism::test {

/// Set by tests/CMakeLists.txt if the program was compiled for another processor.
inline bool emulated() { return std::getenv("PRISM_EMULATED") != nullptr; }

}  // namespace prism::test
