// SPDX-License-Identifier: MIT
// prismweb: serves a web page and an API for the gyros of a host.
#include <csignal>
#include <cstdio>
#include <exception>

#include "tools/prismweb/program.hpp"
#include "tools/prismweb/settings.hpp"

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return prism::prismweb::run(argc, argv);
  } catch (const std::exception& bug) {
    std::fprintf(stderr, "prismweb: internal error: %s; please report it\n", bug.what());
    return prism::prismweb::kExitBug;
  }
}
