// SPDX-License-Identifier: MIT
// Loads and tests a line's frame description.
#pragma once

#include <string>

#include "config/config.hpp"
#include "daemon/pipeline/setup.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::pipeline {

/// Reads the description and runs its test vectors. `place`: where its name was given, for errors. Its wire format is
/// that of `line`, not the suggested one, since time stamps subtract the transmission time of a byte.
Result<wire::FrameDescriptionPtr> load_frames(const std::string& path, const std::string& place,
                                              wire::GyroChoice choice, const config::LineConfig& line);

/// The line's own settings instead of those of `wire`.
wire::WireFormat wire_format(const config::LineConfig& line, wire::WireFormat wire);

// Replay of raw bytes: a recording without arrival times.

/// Opens a capture or raw bytes of the frames. Errors: those of CaptureReader::open().
Result<drivers::CaptureReader> open_capture(const std::string& path, const wire::FrameDescription& frames);

/// Prepares the setup for raw bytes: time comes from the counter and rate_hz (clock "device"), because there may be
/// other bytes between the frames. Without effect for captures. Errors: sensor lines, whose data could not be assigned
/// in time.
Result<void> use_time_of(const drivers::CaptureReader& reader, const std::string& path, Setup& setup);

}  // namespace prism::pipeline
