// SPDX-License-Identifier: MIT
// What of a configuration belongs to an input axis: one on top of the file, or several in "axes".
#pragma once

#include <filesystem>

#include "base/json_section.hpp"
#include "config/config.hpp"

namespace prism::config {

/// Reads the axes and adds to the warnings. Models are looked for as `base`, the file's folder, says.
void read_axes(const Section& top, const std::filesystem::path& base, Config& config);

}  // namespace prism::config
