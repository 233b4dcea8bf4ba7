// SPDX-License-Identifier: MIT
// The x86-64 microarchitecture level of libprism-kernels: the loaded one, and a restart at a lower one.
#pragma once

#include <string>

#include "base/result.hpp"

namespace prism::campaign {

/// Returns "x86-64-v4", "x86-64-v3" or "baseline", by the path from which libprism-kernels was loaded.
std::string loaded_level();

/// Returns if this process computes at `level`. Otherwise restarts the program with the higher levels hidden from the
/// loader and libm. Errors: the level cannot be reached on this machine.
Result<void> run_at_level(const std::string& level, char** argv);

}  // namespace prism::campaign
