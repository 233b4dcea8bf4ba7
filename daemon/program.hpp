// SPDX-License-Identifier: MIT
// Entry point of prismd: live, replay, check or sniff, as the command line requests.
#pragma once

namespace prism::daemon {

inline constexpr int kExitDone = 0, kExitFailed = 1, kExitClock = 3, kExitUsage = 64, kExitBug = 70, kExitConfig = 78;

/// Runs prismd with this command line. Returns the exit code.
int run(int argc, char** argv);

}  // namespace prism::daemon
