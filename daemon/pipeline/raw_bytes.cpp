// SPDX-License-Identifier: MIT
#include "daemon/pipeline/raw_bytes.hpp"

#include <algorithm>

namespace prism::pipeline {

// The pace is that of the longest frames; no time follows from it.
Result<drivers::CaptureReader> open_capture(const std::string& path, const wire::FrameDescription& frames) {
  return drivers::CaptureReader::open(
      path, drivers::RawByteStream{std::max(1.0, frames.rate_hz * frames.max_frame_bytes), 0});
}

Result<void> use_time_of(const drivers::CaptureReader& reader, const std::string& path, Setup& setup) {
  if (!reader.is_bare()) return {};
  if (!setup.sensor_lines.empty())
    return make_error(path, "found raw bytes without arrival times, expected a capture (pcap): sensor lines need them");
  setup.clock.source = drivers::ClockSource::kDevice;
  setup.clock.arrivals_are_measured = false;
  return {};
}

}  // namespace prism::pipeline
