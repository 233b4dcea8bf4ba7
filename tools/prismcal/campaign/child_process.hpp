// SPDX-License-Identifier: MIT
// Starts programs from a list of arguments, without a shell.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::campaign {

/// Starts words[0], found in PATH, in a new process group, so that Ctrl-C does not reach it. Appends stdout and stderr
/// to the file `output`. Errors: the file cannot be opened or the program cannot be started.
Result<pid_t> start_program(const std::vector<std::string>& words, const std::string& output);

/// Runs a program and returns its stdout; appends its stderr to the file `errors`.
/// Errors: those of start_program(), and an exit status other than 0.
Result<std::string> output_of(const std::vector<std::string>& words, const std::string& errors);

}  // namespace prism::campaign
