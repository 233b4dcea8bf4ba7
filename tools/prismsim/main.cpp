// SPDX-License-Identifier: MIT
// prismsim: a simulated laser gyro, on a pseudo-terminal or into a capture file.
#include "tools/prismsim/program.hpp"

int main(int argc, char** argv) { return prism::prismsim::run(argc, argv); }
