// SPDX-License-Identifier: MIT
// A line's frame description, proved.
#pragma once

#include <string>

#include "config/config.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::pipeline {

/// Reads the description and runs its test vectors. Its wire is the line as it is set, not as the description suggests:
/// time stamps subtract the time that a byte takes on it.
Result<wire::FrameDescriptionPtr> load_frames(const std::string& path, const wire::GyroChoice& choice,
                                              const config::LineConfig& line);

}  // namespace prism::pipeline
