// SPDX-License-Identifier: MIT
// The instruction level that a program computes at: which one was loaded, and how to begin again at a lower one.
#pragma once

#include <string>

#include "base/result.hpp"

namespace prism::campaign {

/// "x86-64-v4", "x86-64-v3" or "baseline": where the loader found libprism-kernels.
std::string loaded_level();

/// Returns where this process computes at `level`. Else begins the program again with the levels above kept from the
/// loader and from libm. Errors: a processor without the level, or without levels.
Result<void> run_at_level(const std::string& level, char** argv);

}  // namespace prism::campaign
