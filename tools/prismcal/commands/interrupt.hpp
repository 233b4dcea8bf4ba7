// SPDX-License-Identifier: MIT
// Ctrl-C as a flag, for what takes long.
#pragma once

#include <atomic>

namespace prism::commands {

/// From now on Ctrl-C sets this flag; a second one ends the program.
const std::atomic<bool>* stop_on_interrupt();

/// What a shell expects of a program that was ended by Ctrl-C: 128 + SIGINT.
inline constexpr int kInterrupted = 130;

}  // namespace prism::commands
