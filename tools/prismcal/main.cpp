// SPDX-License-Identifier: MIT
// prismcal: the workbench: train, fit, validate, predict, evaluate, report, verify. One file a command.
#include "tools/prismcal/commands/program.hpp"

int main(int argc, char** argv) { return prism::commands::run(argc, argv); }
