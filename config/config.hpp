// SPDX-License-Identifier: MIT
// Configuration of one prismd, read strictly from one JSON file (comments allowed).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_section.hpp"
#include "base/result.hpp"
#include "compensation/compensation_engine.hpp"
#include "compensation/sensors.hpp"
#include "drivers/transport/transport.hpp"
#include "drivers/wire/description/commands.hpp"

namespace prism::config {

/// Settings of one input axis of the device.
struct AxisConfig {
  std::string name;  ///< as in the frame description; empty: its first (never with "axes")
  double sign = 1;   ///< 1 or −1, from the mounting
  std::optional<double> scale_factor_arcsec_per_pulse;  ///< of this gyro; default: from the frame description
  std::string thermometer;              ///< the sensor used as its temperature T; empty: as in the frame description
  std::string uhfo;                     ///< the sensor used as its UHFO voltage U; empty: as in the frame description
  std::string model, fallback_model;    ///< paths; empty: none
  std::optional<double> elevation_deg;  ///< of the input axis above the horizon; absent: earth rate is not reported
  double azimuth_deg = 0;               ///< of the input axis, from north through east
  bool azimuth_stated = false;
  double direction_mrad = 1;  ///< standard deviation of the axis's direction, each way
  compensation::CompensationSettings
      engine;  ///< its plausibility has defaults only: pipeline::Setup combines the three sources

  bool operator==(const AxisConfig&) const = default;
};

struct LineConfig {
  std::string device;          ///< /dev/serial/by-id/…, or the description of `network`; empty: replay only
  transport::Network network;  ///< instead of a serial device
  // The defaults are in the frame description.
  std::optional<int> baud;
  std::optional<int> data_bits;
  std::optional<wire::Parity> parity;
  std::optional<int> stop_bits;
  double silence_s = 2;      ///< without data for this time the line is lost and reopened, 0.1 to 3600 s
  double retry_min_s = 0.1;  ///< first pause before the line is reopened; doubles up to retry_max_s
  double retry_max_s = 5;
  wire::Commands commands;  ///< parts that replace those of the frame description
  bool allow_send = false;  ///< administrators may send bytes to the device

  bool operator==(const LineConfig&) const = default;
};

/// The line of an additional instrument.
struct SensorLineConfig {
  std::string name;                      ///< its sensors are named NAME.SENSOR
  LineConfig line;                       ///< default of silence_s: stale_after_s
  std::string frames = "ascii-columns";  ///< path of its frame description
  double stale_after_s = 30;             ///< a value is valid for this time
  TextColumns text;

  bool operator==(const SensorLineConfig&) const = default;
};

/// LogSegmentSettings::keep_bytes if only keep_days is configured.
inline constexpr std::int64_t kNoByteLimit = 1LL << 60;

/// Limits of files that are written in segments: log and capture.
struct LogSegmentSettings {
  std::string directory;
  std::int64_t max_bytes = 64 << 20;     ///< a segment is closed before it exceeds this
  std::int64_t max_age_s = 86400;        ///< of data time; segments begin at multiples of it (midnight UTC for a day)
  std::int64_t keep_bytes = 10LL << 30;  ///< the oldest segments are deleted if the sum exceeds this
  std::int64_t keep_days = 3650;
  bool delete_when_full = false;  ///< disk full: delete the oldest segments (true) or drop rows and count them (false)

  bool operator==(const LogSegmentSettings&) const = default;
};

struct SocketSettings {
  std::string path;                              ///< empty: no socket
  int mode = 0660;                               ///< ignored if systemd passes the socket
  std::int64_t client_buffer_bytes = 256 << 10;  ///< data that may wait for a slow client before it loses rows
  int max_clients = 256;

  bool operator==(const SocketSettings&) const = default;
};

/// Policy of an output while the engine has no correction.
enum class WhenUnknown {
  kRaw,   ///< the frames as received
  kHold,  ///< with the last correction for hold_s, then as OutputConfig::then
  kDrop,  ///< nothing
};
inline constexpr std::array kUnknownPolicies = {"raw", "hold", "drop"};

/// A line on which corrected frames leave.
struct OutputConfig {
  LineConfig line = {};
  std::string frames = {};  ///< "same", "prism", or a frame description: name or path
  WhenUnknown when_unknown = WhenUnknown::kRaw;
  double hold_s = 60;     ///< 0: of another policy
  bool then_drop = true;  ///< after hold_s: drop, else raw
  bool unmarked = false;  ///< raw frames may leave although no bit marks the corrected ones
  double fade_deg_per_h_per_s = 0.001;
  bool capture = false;  ///< records the sent bytes

  bool operator==(const OutputConfig&) const = default;
};

struct Config {
  std::string path;              ///< of the configuration file
  std::string name;              ///< of the instance; default: the file's name without ".json"
  std::string gyro_serial;       ///< of the device; models of another serial number are rejected; empty: unknown
  std::vector<AxisConfig> axes;  ///< served axes: at least one
  bool by_axes = false;          ///< true with "axes": each axis has its own log and its own model inputs
  LineConfig line;
  std::string frames = "trplg";   ///< path of the frame description
  std::optional<double> rate_hz;  ///< of this gyro's set-up; default: from the frame description
  std::vector<SensorLineConfig> sensor_lines;
  bool device_clock = false;
  bool accept_clock = false;      ///< no alarm if frames arrive at another rate than described
  double latitude_deg = 0;        ///< north positive, −90 to 90
  SensorStatements plausibility;  ///< in addition to the limits of the frame description
  std::optional<LogSegmentSettings> log, capture;
  std::vector<OutputConfig> outputs;
  SocketSettings socket;
  std::string event_level = "info";
  std::vector<std::string> removed_keys;  ///< one warning per key that has no effect any more
  std::vector<std::string> warnings;      ///< one line each: differences between the file and what prismd does

  bool operator==(const Config&) const = default;
};

/// The axis of this name; without `name` the only axis. Returns nullptr if it does not exist, or if `name` is empty and
/// there are several.
const AxisConfig* find_axis(const Config& config, const std::string& name);

/// Parses a configuration. Relative paths become absolute, relative to the directory of the file; "frames" and models
/// may be bare names, which are searched in the data directories. Errors: file:/pointer: found …, expected ….
Result<Config> parse_config(std::string_view text, const std::string& path);

/// The same from a file.
Result<Config> load_config(const std::string& path);

/// All keys, the one table for reading, printing, prismd.schema.json and prismd.json(5). Paths are read and printed as
/// they are. Reads a configuration with one axis, or none if `by_axes` is true.
const JsonTable<Config>& config_keys();

/// JSON Schema of a configuration file, with the defaults.
nlohmann::ordered_json config_schema();

}  // namespace prism::config
