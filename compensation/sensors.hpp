// SPDX-License-Identifier: MIT
// Further channels of a device, by name: what a frame description or a second line has beside temperature and UHFO.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace prism {

/// The units that a sensor may have, as they stand in files; a column of the log is called NAME_ with the unit in lower
/// case.
inline constexpr const char* kSensorUnits[] = {"degC", "V", "A", "mA", "Pa", "g"};

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
