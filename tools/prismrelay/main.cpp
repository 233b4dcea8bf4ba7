// SPDX-License-Identifier: MIT
// prismrelay: carries rows from this host's prismds to where others look for them.
#include "tools/prismrelay/service.hpp"

int main(int argc, char** argv) { return prism::prismrelay::run(argc, argv); }
