// SPDX-License-Identifier: MIT
// Reads the input axes of a configuration: one at the top level, or several in "axes".
#pragma once

#include <filesystem>

#include "base/json_section.hpp"
#include "config/config.hpp"

namespace prism::config {

/// Reads the axes and adds to the warnings. Model names are relative to `base`, the directory of the file.
void read_axes(const Section& top, const std::filesystem::path& base, Config& config);

}  // namespace prism::config
