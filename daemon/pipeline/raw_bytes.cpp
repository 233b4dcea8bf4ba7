// SPDX-License-Identifier: MIT
#include "daemon/pipeline/raw_bytes.hpp"

#include <algorithm>

namespace prism::pipeline {
namespace {

/// True if time follows from the number of bytes: every frame counts, and all have one length.
bool bytes_tell_time(const wire::FrameDescription& frames) {
  const wire::LengthRule& length = frames.kinds.front().length;
  return frames.kinds.size() == 1 && frames.counts_frames() && length.min == frames.max_frame_bytes &&
         length.max == frames.max_frame_bytes;
}

}  // namespace

// The pace of raw bytes is that of the longest frames; see bytes_tell_time().
Result<drivers::CaptureReader> open_capture(const std::string& path, const wire::FrameDescription& frames) {
  return drivers::CaptureReader::open(
      path, drivers::RawByteStream{std::max(1.0, frames.rate_hz * frames.max_frame_bytes), 0});
}

Result<void> use_time_of(const drivers::CaptureReader& reader, const std::string& path, Setup& setup) {
  if (!reader.is_bare() || bytes_tell_time(*setup.frames)) return {};
  if (!setup.sensor_lines.empty())
    return make_error(path, "found raw bytes without arrival times, expected a capture (pcap): sensor lines need them");
  setup.clock.source = drivers::ClockSource::kDevice;
  setup.clock.arrivals_are_measured = false;
  return {};
}

}  // namespace prism::pipeline
