// SPDX-License-Identifier: MIT
// A capture as a recording: decoder, clock and averager as live.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>

#include "compensation/averager.hpp"
#include "compensation/sha256.hpp"
#include "config/config.hpp"
#include "config/text_file.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/clock.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"
#include "drivers/wire/description/frame_description.hpp"
#include "tools/prismcal/recordings/csv_table.hpp"
#include "tools/prismcal/recordings/source.hpp"

namespace prism::recordings {
namespace {

// The same way as live: decoder, clock, averager; a session ends where the line was opened again.
class CaptureRun {
 public:
  CaptureRun(wire::FrameDescriptionPtr frames, drivers::ClockSettings clock, Recording& recording)
      : decoder_(frames), clock_(frames, clock), recording_(recording) {}

  void pass(const drivers::CapturePacket& packet) {
    if (packet.event == drivers::CaptureEvent::kOpened) {
      finish();
      decoder_.reset();
      clock_.reset();
    } else if (packet.event == drivers::CaptureEvent::kData) {
      readings_.clear();
      decoder_.feed(packet.bytes, packet.time_ns, readings_);
      take();
    }
  }
  void finish() {
    readings_.clear();
    decoder_.finish(readings_);
    take();
    if (const auto bucket = averager_.finish()) recording_.buckets.push_back(*bucket);
  }

 private:
  void take() {
    for (const wire::Reading& reading : readings_) {
      const auto sample = clock_.push(reading);
      const auto bucket = sample ? averager_.push(*sample) : std::nullopt;
      if (bucket) recording_.buckets.push_back(*bucket);
    }
  }
  wire::FrameDecoder decoder_;
  drivers::Clock clock_;
  compensation::Averager averager_;
  Recording& recording_;
  std::vector<wire::Reading> readings_;
};

Result<wire::FrameDescriptionPtr> frames_of(const config::Config& config) {
  const auto text = config::read_text_file(config.frames);
  if (!text) return tl::unexpected<Error>(text.error());
  wire::GyroChoice choice;
  choice.axis = config.gyro.axis;
  choice.sign = config.gyro.sign;
  choice.scale_factor_arcsec_per_pulse = config.gyro.scale_factor_arcsec_per_pulse;
  return wire::parse_frame_description(*text, config.frames, choice);
}

}  // namespace

bool is_capture(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  unsigned char magic[4] = {};
  in.read(reinterpret_cast<char*>(magic), sizeof magic);
  const std::uint32_t value = magic[0] | magic[1] << 8 | magic[2] << 16 | static_cast<std::uint32_t>(magic[3]) << 24;
  return value == 0xa1b23c4d || value == 0xa1b2c3d4 || value == 0x4d3cb2a1 || value == 0xd4c3b2a1 ||
         value == 0x0a0d0d0a;
}

Result<Recording> read_capture(const std::string& path, const SourceOptions& options) {
  if (options.config.empty())
    return refuse(path, "is a capture: say --config PRISMD.JSON, so that its frames can be read");
  const auto config = config::load_config(options.config);
  if (!config) return tl::unexpected<Error>(config.error());
  const auto frames = frames_of(*config);
  if (!frames) return tl::unexpected<Error>(frames.error());
  const drivers::BareBytes bare{std::max(1.0, (*frames)->rate_hz * (*frames)->max_frame_bytes), 0};
  auto reader = drivers::CaptureReader::open(path, bare);
  if (!reader) return tl::unexpected<Error>(reader.error());
  Recording recording;
  recording.name = std::filesystem::path(path).stem().string();
  recording.metadata["gyro_serial"] = config->gyro.serial.empty() ? "unknown" : config->gyro.serial;
  if (config->site.elevation_deg) {
    recording.metadata["site"] =
        fmt::format("latitude_deg {} elevation_deg {} azimuth_deg {}", config->site.latitude_deg,
                    *config->site.elevation_deg, config->site.azimuth_deg);
  }
  drivers::ClockSettings clock;
  clock.source = config->device_clock ? drivers::ClockSource::kDevice : drivers::ClockSource::kHost;
  CaptureRun run(*frames, clock, recording);
  std::size_t packets = 0;
  while (const auto packet = reader->next()) {
    run.pass(*packet);
    ++packets;
  }
  run.finish();
  if (recording.buckets.empty()) return refuse(path, "holds no frame of " + config->frames);
  const auto text = config::read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  recording.files.push_back({path, sha256_hex(*text), packets});
  return recording;
}

}  // namespace prism::recordings
