// SPDX-License-Identifier: MIT
// Further channels of a device, by name: the sensors of a frame description or a second line, besides T and UHFO.
#pragma once

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_section.hpp"

namespace prism {

/// A unit of a sensor. The schemas in config/ list the same units; a test compares them.
struct SensorUnit {
  const char* unit;    ///< in files
  const char* suffix;  ///< the column in the log is called NAME_SUFFIX
  const char* metric;  ///< metric family of Prometheus
};
inline constexpr SensorUnit kSensorUnits[] = {
    {"degC", "degc", "prism_sensor_celsius"},  {"V", "v", "prism_sensor_volts"},     {"A", "a", "prism_sensor_amperes"},
    {"mA", "ma", "prism_sensor_milliamperes"}, {"Pa", "pa", "prism_sensor_pascals"}, {"g", "g", "prism_sensor_g"},
};
/// Their names, for Section::choice.
inline constexpr auto kSensorUnitNames = [] {
  std::array<const char*, std::size(kSensorUnits)> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kSensorUnits[i].unit;
  return names;
}();

struct SensorName {
  std::string name;  ///< letters, digits, '_' and '.', not one of the inputs T, U and dTdt
  std::string unit;  ///< one of kSensorUnits

  bool operator==(const SensorName&) const = default;
};

/// The sensors of a stream, in the order of their values. Shared by all objects that contain values.
using SensorList = std::shared_ptr<const std::vector<SensorName>>;

/// Returns the list, or an empty one for null.
const std::vector<SensorName>& sensors_of_list(const SensorList& list);

/// Returns true for the reserved names of model inputs: T, dTdt, U.
bool is_own_input(std::string_view name);
/// Returns true if a sensor may have this name: see SensorName.
bool is_sensor_name(std::string_view name);

/// "case_degc"
std::string sensor_column(const SensorName& sensor);
/// The sensor of this column; nullopt if the name does not end in a known unit.
std::optional<SensorName> sensor_of_column(std::string_view column);

/// Index of `name` in the list; the list's size if absent.
inline std::size_t sensor_index(const std::vector<SensorName>& sensors, std::string_view name) {
  const auto found =
      std::find_if(sensors.begin(), sensors.end(), [&](const SensorName& sensor) { return sensor.name == name; });
  return static_cast<std::size_t>(found - sensors.begin());
}

/// "case, anode", or "none".
std::string sensors_text(const std::vector<SensorName>& sensors);

// Limits of a sensor in a frame description or a configuration: range and slope.

/// Settings without a value do not change the earlier one.
struct SensorStatement {
  std::optional<Range> range;  ///< closed; in deg/h, degC or V
  std::optional<double> greatest_slope_per_s;
  std::optional<double> stuck_s;  ///< a value that is constant for longer is rejected

  bool operator==(const SensorStatement&) const = default;
};

struct SensorStatements {
  SensorStatement rate, temperature, uhfo;
  bool operator==(const SensorStatements&) const = default;
};

/// The key of a range, [low, high]: two numbers within `allowed`, low below high; `unit` is the unit of the statement.
/// Returns none if absent.
std::optional<Range> read_range(const Section& section, const char* key, Range allowed, double unit = 1);

/// Allowed values of ranges, in deg/s, and in degC or V.
inline constexpr Range kRateRanges{-1e9, 1e9}, kChannelRanges{-1e6, 1e6};
inline constexpr double kDegPerSInDegPerH = 3600;

// Sensors of an instrument that prints lines of numbers: columns → sensors.

struct TextColumn {
  SensorName sensor;
  int column = 0;                                      ///< from 0
  double min = std::numeric_limits<double>::lowest();  ///< in the sensor's unit; values outside are unknown
  double max = std::numeric_limits<double>::max();

  bool operator==(const TextColumn&) const = default;
};

/// The frame description defines how to find a line; this defines its content.
struct TextColumns {
  std::vector<TextColumn> columns = {};  ///< empty: the description's own sensors
  std::string separators = ",;\t";       ///< if only blanks, a run of them counts as one
  bool ends_with_cr = false;             ///< a line ends with CR alone, otherwise with LF or CR LF
  bool decimal_comma = false;            ///< "23,5"

  bool operator==(const TextColumns&) const = default;
};

/// Why these characters cannot be separators; empty: they can. The word "semicolon" would be nine of them, and a sign
/// would be lost.
std::string separators_problem(const std::string& separators);

}  // namespace prism
