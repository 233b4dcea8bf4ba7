// SPDX-License-Identifier: MIT
#include "tools/prismcal/training/source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>

#include "compensation/averager.hpp"
#include "compensation/sha256.hpp"
#include "config/config.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/clock.hpp"
#include "drivers/wire/frame_decoder.hpp"
#include "drivers/wire/frame_description.hpp"
#include "tools/prismcal/training/csv_table.hpp"

namespace prism {
namespace {

// ---- mapped CSV ----

struct Unit {
  const char* quantity;
  const char* name;
  double factor, offset;
};

constexpr Unit kUnits[] = {
    {"rate", "deg/h", 1, 0},          {"rate", "arcsec/s", 1, 0},
    {"rate", "deg/s", 3600, 0},       {"rate", "rad/s", 3600 * 180 / std::numbers::pi, 0},
    {"temperature", "degC", 1, 0},    {"temperature", "K", 1, -273.15},
    {"temperature", "degF", 5.0 / 9, -160.0 / 9}, {"uhfo", "V", 1, 0},
    {"uhfo", "mV", 1e-3, 0},          {"time", "s", 1, 0},
    {"time", "ms", 1e-3, 0},          {"time", "us", 1e-6, 0},
    {"time", "ns", 1e-9, 0},
};

struct Mapped {
  std::string column;
  const Unit* unit;
};
using Map = std::map<std::string, Mapped>;

Result<Map> parse_map(const std::vector<std::string>& entries) {
  Map map;
  for (const std::string& entry : entries) {
    const std::size_t equals = entry.find('='), colon = entry.rfind(':');
    if (equals == std::string::npos || colon == std::string::npos || colon < equals) {
      return refuse("--map", fmt::format("found \"{}\", expected QUANTITY=COLUMN:UNIT, as rate=rate_x:deg/s", entry));
    }
    const std::string quantity = entry.substr(0, equals), unit = entry.substr(colon + 1);
    const auto* found = std::find_if(std::begin(kUnits), std::end(kUnits), [&](const Unit& u) { return quantity == u.quantity && unit == u.name; });
    if (found == std::end(kUnits)) {
      std::string known;
      for (const Unit& u : kUnits) known += fmt::format("{}{} in {}", known.empty() ? "" : ", ", u.quantity, u.name);
      return refuse("--map", fmt::format("found {} in \"{}\", expected one of: {}", quantity, unit, known));
    }
    if (!map.emplace(quantity, Mapped{entry.substr(equals + 1, colon - equals - 1), found}).second) {
      return refuse("--map", quantity + " is given twice");
    }
  }
  if (!map.contains("rate")) return refuse("--map", "found no rate, expected rate=COLUMN:UNIT");
  return map;
}

Result<std::vector<double>> converted(const CsvTable& table, const Map& map, const std::string& quantity) {
  const auto at = map.find(quantity);
  if (at == map.end()) return std::vector<double>(table.rows(), kUnknown);
  auto values = table.column(at->second.column);
  if (!values) return values;
  for (double& value : *values) value = value * at->second.unit->factor + at->second.unit->offset;
  return values;
}

void push(Averager& averager, Recording& recording, const Sample& sample) {
  if (const auto bucket = averager.push(sample)) recording.buckets.push_back(*bucket);
}

Result<Recording> read_mapped(const std::string& path, const SourceOptions& options) {
  const auto map = parse_map(options.map);
  if (!map) return tl::unexpected<Error>(map.error());
  const auto table = CsvTable::read(path);
  if (!table) return tl::unexpected<Error>(table.error());
  const auto rate = converted(*table, *map, "rate"), temperature = converted(*table, *map, "temperature");
  const auto uhfo = converted(*table, *map, "uhfo"), time = converted(*table, *map, "time");
  for (const auto* column : {&rate, &temperature, &uhfo, &time}) {
    if (!*column) return tl::unexpected<Error>(column->error());
  }
  const bool timed = map->contains("time");
  if (!timed && !(options.interval_s > 0)) return refuse(path, "found no time, expected --map time=COLUMN:UNIT or --interval SECONDS");
  Recording recording;
  recording.name = std::filesystem::path(path).stem().string();
  recording.files.push_back({path, table->sha256(), table->rows()});
  Averager averager;
  for (std::size_t i = 0; i < table->rows(); ++i) {
    const double now = timed ? (*time)[i] : static_cast<double>(i + 1) * options.interval_s;
    const double before = timed ? (i > 0 ? (*time)[i - 1] : table->rows() > 1 ? now - ((*time)[1] - now) : now - 1) : now - options.interval_s;
    if (!(now > before)) return refuse(fmt::format("{}, row {}", path, i + 1), fmt::format("time {} does not come after {}", now, before));
    Sample sample;
    sample.time_ns = std::llround(now * 1e9);
    sample.interval_s = now - before;
    sample.rate_deg_per_h = (*rate)[i];
    sample.temperature_degc = (*temperature)[i];
    sample.uhfo_v = (*uhfo)[i];
    push(averager, recording, sample);
  }
  if (const auto bucket = averager.finish()) recording.buckets.push_back(*bucket);
  return recording;
}

// ---- captures ----

bool is_capture(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  unsigned char magic[4] = {};
  in.read(reinterpret_cast<char*>(magic), sizeof magic);
  const std::uint32_t value = magic[0] | magic[1] << 8 | magic[2] << 16 | static_cast<std::uint32_t>(magic[3]) << 24;
  return value == 0xa1b23c4d || value == 0xa1b2c3d4 || value == 0x4d3cb2a1 || value == 0xd4c3b2a1 || value == 0x0a0d0d0a;
}

// The same way as live: decoder, clock, averager; a session ends where the line was opened again.
class CaptureRun {
 public:
  CaptureRun(FrameDescriptionPtr frames, ClockSettings clock, Recording& recording)
      : decoder_(frames), clock_(frames, clock), recording_(recording) {}

  void pass(const CapturePacket& packet) {
    if (packet.event == CaptureEvent::kOpened) {
      finish();
      decoder_.reset();
      clock_.reset();
    } else if (packet.event == CaptureEvent::kData) {
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
    for (const Reading& reading : readings_) {
      if (const auto sample = clock_.push(reading)) push(averager_, recording_, *sample);
    }
  }
  FrameDecoder decoder_;
  Clock clock_;
  Averager averager_;
  Recording& recording_;
  std::vector<Reading> readings_;
};

Result<FrameDescriptionPtr> frames_of(const Config& config) {
  const auto text = read_text_file(config.frames);
  if (!text) return tl::unexpected<Error>(text.error());
  GyroChoice choice;
  choice.axis = config.gyro.axis;
  choice.sign = config.gyro.sign;
  choice.scale_factor_arcsec_per_pulse = config.gyro.scale_factor_arcsec_per_pulse;
  return parse_frame_description(*text, config.frames, choice);
}

Result<Recording> read_capture(const std::string& path, const SourceOptions& options) {
  if (options.config.empty()) return refuse(path, "is a capture: say --config PRISMD.JSON, so that its frames can be read");
  const auto config = load_config(options.config);
  if (!config) return tl::unexpected<Error>(config.error());
  const auto frames = frames_of(*config);
  if (!frames) return tl::unexpected<Error>(frames.error());
  const BareBytes bare{std::max(1.0, (*frames)->rate_hz * (*frames)->max_frame_bytes), 0};
  auto reader = CaptureReader::open(path, bare);
  if (!reader) return tl::unexpected<Error>(reader.error());
  Recording recording;
  recording.name = std::filesystem::path(path).stem().string();
  recording.metadata["gyro_serial"] = config->gyro.serial.empty() ? "unknown" : config->gyro.serial;
  if (config->site.elevation_deg) {
    recording.metadata["site"] = fmt::format("latitude_deg {} elevation_deg {} azimuth_deg {}", config->site.latitude_deg,
                                             *config->site.elevation_deg, config->site.azimuth_deg);
  }
  ClockSettings clock;
  clock.source = config->device_clock ? ClockSource::kDevice : ClockSource::kHost;
  CaptureRun run(*frames, clock, recording);
  std::size_t packets = 0;
  while (const auto packet = reader->next()) {
    run.pass(*packet);
    ++packets;
  }
  run.finish();
  if (recording.buckets.empty()) return refuse(path, "holds no frame of " + config->frames);
  const auto text = read_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  recording.files.push_back({path, sha256_hex(*text), packets});
  return recording;
}

}  // namespace

Result<Recording> read_source(const std::string& path, const SourceOptions& options) {
  if (!options.map.empty()) return read_mapped(path, options);
  return is_capture(path) ? read_capture(path, options) : read_recording(path);
}

}  // namespace prism
