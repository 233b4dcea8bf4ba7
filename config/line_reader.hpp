// SPDX-License-Identifier: MIT
// The serial lines of a configuration: the gyro's, and those of instruments beside it.
#pragma once

#include <filesystem>

#include "base/json_section.hpp"
#include "config/config.hpp"

namespace prism::config {

/// How a line is opened; `preset` has the defaults. The device's path is relative to `base`, the file's folder.
LineConfig read_line(const Section& section, const std::filesystem::path& base, LineConfig preset = {});

/// "sensor_lines", which belong to the form with "axes".
void read_sensor_lines(const Section& top, const std::filesystem::path& base, Config& config);

}  // namespace prism::config
