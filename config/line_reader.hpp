// SPDX-License-Identifier: MIT
// Reads the serial lines of a configuration: the gyro's and those of additional instruments.
#pragma once

#include <filesystem>

#include "base/json_section.hpp"
#include "config/config.hpp"

namespace prism::config {

/// Reads the settings of a line; `defaults` has the defaults. The device's path is relative to `base`, the directory of
/// the file.
LineConfig read_line(const Section& section, const std::filesystem::path& base, LineConfig defaults = {});

/// Reads "sensor_lines", which require "axes".
void read_sensor_lines(const Section& top, const std::filesystem::path& base, Config& config);

}  // namespace prism::config
