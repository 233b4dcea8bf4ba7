// SPDX-License-Identifier: MIT
#include "compensation/sensors.hpp"

#include <cctype>

#include "base/outside_text.hpp"

namespace prism {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

}  // namespace

const std::vector<SensorName>& sensors_of_list(const SensorList& list) {
  static const std::vector<SensorName> kNone;
  return list ? *list : kNone;
}

bool is_own_input(std::string_view name) {
  if (name == "T" || name == "dTdt" || name == "U") return true;
  return name.size() > 3 && name.starts_with("lag") &&
         std::all_of(name.begin() + 3, name.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool is_sensor_name(std::string_view name) { return follows(TextRule::kSensorName, name) && !is_own_input(name); }

std::string sensor_column(const SensorName& sensor) { return sensor.name + "_" + lower(sensor.unit); }

std::optional<SensorName> sensor_of_column(std::string_view column) {
  for (const char* unit : kSensorUnits) {
    const std::string end = "_" + lower(unit);
    if (column.size() > end.size() && column.ends_with(end))
      return SensorName{std::string(column.substr(0, column.size() - end.size())), unit};
  }
  return std::nullopt;
}

std::string sensors_text(const std::vector<SensorName>& sensors) {
  std::string text;
  for (const SensorName& sensor : sensors) text += (text.empty() ? "" : ", ") + sensor.name;
  return text.empty() ? "none" : text;
}

}  // namespace prism
