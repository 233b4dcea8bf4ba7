// SPDX-License-Identifier: MIT
// prismctl: command-line client of prismd.
#include "tools/prismctl/commands.hpp"

int main(int argc, char** argv) { return prism::prismctl::run(argc, argv); }
