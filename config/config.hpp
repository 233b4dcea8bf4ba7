// SPDX-License-Identifier: MIT
// What a person may set: the configuration of one prismd, read strictly from one JSON file (comments allowed).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "compensation/engine.hpp"
#include "compensation/sensor_limits.hpp"
#include "compensation/text_columns.hpp"

namespace prism::config {

/// What belongs to one input axis of the device.
struct AxisConfig {
  std::string name;  ///< as the frame description calls it; empty: its first (never where "axes" names them)
  double sign = 1;   ///< 1 or −1: the mounting
  std::optional<double> scale_factor_arcsec_per_pulse;  ///< of this very gyro; default: the description's
  std::string thermometer;                              ///< the sensor that is its T; empty: the description's
  std::string model, fallback_model;                    ///< paths; empty: none
  std::optional<double> elevation_deg;  ///< of the input axis above the horizon; absent: earth rate is not reported
  double azimuth_deg = 0;               ///< of the input axis, from north through east
  compensation::EngineSettings engine;  ///< its plausibility is of presets only: pipeline::Setup joins all three

  bool operator==(const AxisConfig&) const = default;
};

struct LineConfig {
  std::string device;  ///< /dev/serial/by-id/…; empty: no live line (replay only)
  // Defaults come from the frame description.
  std::optional<int> baud;
  std::optional<int> data_bits;
  std::optional<std::string> parity;  ///< "none", "even" or "odd"
  std::optional<int> stop_bits;
  double silence_s = 2;      ///< no byte for so long: the line counts as lost and is opened again, 0.1 to 3600 s
  double retry_min_s = 0.1;  ///< first pause before the line is opened again; doubles up to retry_max_s
  double retry_max_s = 5;

  bool operator==(const LineConfig&) const = default;
};

/// The line of an instrument beside the gyro.
struct SensorLineConfig {
  std::string name;           ///< its sensors are called NAME.SENSOR
  LineConfig line;            ///< silence_s: preset stale_after_s
  std::string frames;         ///< path of its frame description
  double stale_after_s = 30;  ///< a value serves for so long
  TextColumns text;

  bool operator==(const SensorLineConfig&) const = default;
};

/// Files written in segments: the log and the capture.
struct SegmentSettings {
  std::string directory;
  std::int64_t max_bytes = 64 << 20;     ///< a segment that would grow beyond it is closed
  std::int64_t max_age_s = 86400;        ///< of data time; segments begin at multiples of it (midnight UTC for a day)
  std::int64_t keep_bytes = 10LL << 30;  ///< the oldest segments are deleted beyond this sum
  std::int64_t keep_days = 3650;
  std::vector<std::string>
      keep_for;                   ///< followers of the log: what they have not fetched stays while the disk has room
  bool delete_when_full = false;  ///< disk full: delete the oldest segments (true) or drop rows and count them (false)

  bool operator==(const SegmentSettings&) const = default;
};

struct SocketSettings {
  std::string path;                              ///< empty: no socket
  int mode = 0660;                               ///< ignored where systemd hands the socket over
  std::int64_t client_buffer_bytes = 256 << 10;  ///< what a client may lag behind before it loses rows
  int max_clients = 256;

  bool operator==(const SocketSettings&) const = default;
};

struct Config {
  std::string path;              ///< the file it came from
  std::string name;              ///< of the instance; default: the file's name without ".json"
  std::string gyro_serial;       ///< of the device on the line; a model bound to another is refused; empty: unknown
  std::vector<AxisConfig> axes;  ///< to be served: at least one
  bool by_axes = false;  ///< the file names them in "axes": each has a log of its own, and its own inputs of a model
  LineConfig line;
  std::string frames;  ///< path of the frame description
  std::vector<SensorLineConfig> sensor_lines;
  bool device_clock = false;
  double latitude_deg = 0;        ///< north positive, −90 to 90
  SensorStatements plausibility;  ///< beside what the frame description states
  std::optional<SegmentSettings> log, capture;
  SocketSettings socket;
  std::string event_level = "info";
  std::vector<std::string> warnings;  ///< a line each: what is served otherwise than the file says

  bool operator==(const Config&) const = default;
};

/// The axis of this name; the only one that a file without "axes" has; without `name` the only one there is. Null:
/// there is none, or `name` had to choose.
const AxisConfig* find_axis(const Config& config, const std::string& name);

/// Reads a configuration from its text. Paths in it become absolute: relative ones are relative to the file's folder;
/// "frames" and models may be bare names, searched in the data folders. Every refusal: file:/pointer: found, expected.
Result<Config> parse_config(std::string_view text, const std::string& path);

/// The same from a file.
Result<Config> load_config(const std::string& path);

}  // namespace prism::config
