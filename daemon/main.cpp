// SPDX-License-Identifier: MIT
// prismd: acquire, compensate, log, publish.
#include <csignal>
#include <cstdio>
#include <exception>

#include "daemon/program.hpp"

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a closed stderr must not end prismd
  try {
    return prism::daemon::run(argc, argv);
  } catch (const std::exception& bug) {
    std::fprintf(stderr, "prismd: internal error: %s; please report it\n", bug.what());
    return prism::daemon::kExitBug;
  }
}
