// SPDX-License-Identifier: MIT
// How fast the log and the capture grow, and whether their directories can be written, before there are data.
#pragma once

#include <string>

#include "daemon/pipeline/setup.hpp"

namespace prism::pipeline {

/// From the described frame rate and lengths, as measured. 0: not configured.
double log_bytes_per_day(const Setup& setup);
double capture_bytes_per_day(const Setup& setup);

/// Why the service would not be able to write to `directory`, as far as this user can tell without writing; "" if
/// nothing speaks against it. Asks the file system; may wait for it.
std::string directory_problem(const std::string& directory);

}  // namespace prism::pipeline
