// SPDX-License-Identifier: MIT
// Replay of raw bytes: a recording without arrival times.
#pragma once

#include <string>

#include "daemon/pipeline/setup.hpp"
#include "drivers/capture_file.hpp"

namespace prism::pipeline {

/// Opens a capture or raw bytes of the frames. Errors: those of CaptureReader::open().
Result<drivers::CaptureReader> open_capture(const std::string& path, const wire::FrameDescription& frames);

/// Prepares the setup for raw bytes: time comes from the counter and rate_hz (clock "device"), because there may be
/// other bytes between the frames. Without effect for captures. Errors: sensor lines, whose data could not be assigned
/// in time.
Result<void> use_time_of(const drivers::CaptureReader& reader, const std::string& path, Setup& setup);

}  // namespace prism::pipeline
