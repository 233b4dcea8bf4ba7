// SPDX-License-Identifier: MIT
// Further channels of a device, by name: what a frame description or a second line has beside temperature and UHFO.
#pragma once

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace prism {

/// A unit that a sensor may have. The schemas in config/ list the same units; a test compares them.
struct SensorUnit {
  const char* unit;    ///< in files
  const char* suffix;  ///< a column of the log is called NAME_SUFFIX
  const char* metric;  ///< Prometheus's family
};
inline constexpr SensorUnit kSensorUnits[] = {
    {"degC", "degc", "prism_sensor_celsius"},  {"V", "v", "prism_sensor_volts"},     {"A", "a", "prism_sensor_amperes"},
    {"mA", "ma", "prism_sensor_milliamperes"}, {"Pa", "pa", "prism_sensor_pascals"}, {"g", "g", "prism_sensor_g"},
};
/// Their names, as Section::choice takes them.
inline constexpr auto kSensorUnitNames = [] {
  std::array<const char*, std::size(kSensorUnits)> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kSensorUnits[i].unit;
  return names;
}();

struct SensorName {
  std::string name;  ///< letters, digits, '_' and '.', not one of the inputs T, U, dTdt and lagN
  std::string unit;  ///< one of kSensorUnits

  bool operator==(const SensorName&) const = default;
};

/// Those of a stream, in the order of their values. Shared by all that carry values.
using SensorList = std::shared_ptr<const std::vector<SensorName>>;

/// An empty one where there is no list.
const std::vector<SensorName>& sensors_of_list(const SensorList& list);

/// One of the names of model inputs that are no sensor's: T, dTdt, U, lagN.
bool is_own_input(std::string_view name);
/// True where it can be a sensor's: see SensorName.
bool is_sensor_name(std::string_view name);

/// "case_degc"
std::string sensor_column(const SensorName& sensor);
/// The sensor whose column this is; nothing where no unit stands at its end.
std::optional<SensorName> sensor_of_column(std::string_view column);

/// Where `name` stands in the list; its size where it does not.
inline std::size_t sensor_index(const std::vector<SensorName>& sensors, std::string_view name) {
  const auto found =
      std::find_if(sensors.begin(), sensors.end(), [&](const SensorName& sensor) { return sensor.name == name; });
  return static_cast<std::size_t>(found - sensors.begin());
}

/// "case, anode", or "none".
std::string sensors_text(const std::vector<SensorName>& sensors);

}  // namespace prism
