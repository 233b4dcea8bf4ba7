// SPDX-License-Identifier: MIT
// Programs that a campaign starts: by a list of arguments, never by a shell.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::campaign {

/// Starts words[0], searched in PATH, in a process group of its own, so that Ctrl-C does not reach it. Both of its
/// outputs are appended to the file `output`. Errors: the file or the program cannot be opened.
Result<pid_t> start_program(const std::vector<std::string>& words, const std::string& output);

/// Runs a program to its end and returns what it printed on stdout; stderr is appended to the file `errors`.
/// Errors: as start_program(), and an exit status other than 0.
Result<std::string> output_of(const std::vector<std::string>& words, const std::string& errors);

}  // namespace prism::campaign
