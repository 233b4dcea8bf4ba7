// SPDX-License-Identifier: MIT
// Loads and tests a line's frame description.
#pragma once

#include <string>

#include "config/config.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::pipeline {

/// Reads the description and runs its test vectors. `place`: where its name was given, for errors. Its wire format is
/// that of `line`, not the suggested one, since time stamps subtract the transmission time of a byte.
Result<wire::FrameDescriptionPtr> load_frames(const std::string& path, const std::string& place,
                                              wire::GyroChoice choice, const config::LineConfig& line);

}  // namespace prism::pipeline
