// SPDX-License-Identifier: MIT
// Replay of raw bytes: a recording without arrival times.
#pragma once

#include <string>

#include "daemon/pipeline/setup.hpp"
#include "drivers/capture_file.hpp"

namespace prism::pipeline {

/// The pace of raw bytes: frames of the longest message type at the described rate. It is the true pace only if all
/// frames have one length.
drivers::RawByteStream raw_byte_stream(const wire::FrameDescription& frames);

/// Opens a capture or raw bytes for the setup's gyro line. If frames have several lengths, the time within raw bytes
/// comes from the counter and rate_hz (clock "device"), and setup.clock is changed. Errors: those of
/// CaptureReader::open(); such raw bytes together with sensor lines, whose data could not be assigned in time.
Result<drivers::CaptureReader> open_capture(const std::string& path, Setup& setup);

}  // namespace prism::pipeline
