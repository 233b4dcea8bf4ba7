// SPDX-License-Identifier: MIT
// prismd as its command line asks for it: live, replay, a check or a sniff.
#pragma once

namespace prism::daemon {

inline constexpr int kExitDone = 0, kExitFailed = 1, kExitUsage = 64, kExitBug = 70, kExitConfig = 78;

/// Does what the command line says. Returns the exit code.
int run(int argc, char** argv);

}  // namespace prism::daemon
