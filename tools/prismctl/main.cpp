// SPDX-License-Identifier: MIT
// prismctl: asks a running prismd.
#include "tools/prismctl/commands.hpp"

int main(int argc, char** argv) { return prism::prismctl::run(argc, argv); }
