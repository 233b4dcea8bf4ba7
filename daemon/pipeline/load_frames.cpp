// SPDX-License-Identifier: MIT
#include "daemon/pipeline/load_frames.hpp"

#include <algorithm>
#include <memory>

#include "config/search_path.hpp"
#include "drivers/transport/endpoint.hpp"
#include "drivers/wire/decode/inspect.hpp"

namespace prism::pipeline {
wire::WireFormat wire_format(const config::LineConfig& line, wire::WireFormat wire) {
  wire.baud = line.baud.value_or(wire.baud);
  wire.data_bits = line.data_bits.value_or(wire.data_bits);
  wire.stop_bits = line.stop_bits.value_or(wire.stop_bits);
  if (line.parity)
    wire.parity = *line.parity == "even"  ? wire::Parity::kEven
                  : *line.parity == "odd" ? wire::Parity::kOdd
                                          : wire::Parity::kNone;
  return wire;
}

Result<wire::FrameDescriptionPtr> load_frames(const std::string& path, const std::string& place,
                                              wire::GyroChoice choice, const config::LineConfig& line) {
  choice.baud = line.baud;
  choice.network = !line.network.type.empty();
  const Result<std::string> text = config::read_data_file(path, "frames", place);
  if (!text) return tl::unexpected<Error>(text.error());
  Result<wire::FrameDescriptionPtr> frames = wire::parse_frame_description(*text, path, choice);
  if (!frames) return frames;
  if (auto proved = wire::run_test_vectors(**frames); !proved) return tl::unexpected<Error>(proved.error());
  auto effective = std::make_shared<wire::FrameDescription>(**frames);
  effective->wire = wire_format(line, effective->wire);
  effective->commands = effective->commands.with(line.commands);
  if (effective->commands.poll && line.network.type == "udp") {
    const auto to = transport::parse_numeric_endpoint(line.network.from);
    if (!to || to->port.empty())
      return make_error(place,
                        "its poll has nowhere to go: expected \"udp\": {\"from\": \"ADDRESS:PORT\"} of the device");
  }
  return wire::FrameDescriptionPtr(std::move(effective));
}

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
