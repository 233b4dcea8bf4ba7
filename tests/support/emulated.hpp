// SPDX-License-Identifier: MIT
// Tests that an emulator cannot run: qemu-user knows no termios2, which a line is opened with, and its time is no
// processor's.
#pragma once

#include <cstdlib>

namespace prism::test {

/// Set by tests/CMakeLists.txt where the program was compiled for another processor.
inline bool emulated() { return std::getenv("PRISM_EMULATED") != nullptr; }

}  // namespace prism::test
