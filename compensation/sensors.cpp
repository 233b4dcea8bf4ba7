// SPDX-License-Identifier: MIT
#include "compensation/sensors.hpp"

#include <fmt/format.h>

#include <cctype>
#include <vector>

#include "base/outside_text.hpp"

namespace prism {
namespace {

const SensorUnit* find_unit(std::string_view unit) {
  const auto* const found = std::find_if(std::begin(kSensorUnits), std::end(kSensorUnits),
                                         [&](const SensorUnit& u) { return u.unit == unit; });
  return found != std::end(kSensorUnits) ? found : nullptr;
}

}  // namespace

const std::vector<SensorName>& sensors_of_list(const SensorList& list) {
  static const std::vector<SensorName> kNone;
  return list ? *list : kNone;
}

bool is_own_input(std::string_view name) { return name == "T" || name == "dTdt" || name == "U"; }

bool is_sensor_name(std::string_view name) { return follows(TextRule::kSensorName, name) && !is_own_input(name); }

std::string sensor_column(const SensorName& sensor) {
  const SensorUnit* const unit = find_unit(sensor.unit);
  return sensor.name + "_" + (unit != nullptr ? unit->suffix : sensor.unit);
}

std::optional<SensorName> sensor_of_column(std::string_view column) {
  for (const SensorUnit& unit : kSensorUnits) {
    const std::string end = std::string("_") + unit.suffix;
    if (column.size() > end.size() && column.ends_with(end))
      return SensorName{std::string(column.substr(0, column.size() - end.size())), unit.unit};
  }
  return std::nullopt;
}

std::string sensors_text(const std::vector<SensorName>& sensors) {
  std::string text;
  for (const SensorName& sensor : sensors) text += (text.empty() ? "" : ", ") + sensor.name;
  return text.empty() ? "none" : text;
}

std::optional<Range> read_range(const Section& section, const char* key, Range allowed, double unit) {
  if (!section.has(key)) return std::nullopt;
  const std::vector<double> ends = section.numbers(key, allowed);
  if (!section.good()) return std::nullopt;
  if (ends.size() != 2 || !(ends[0] < ends[1])) {
    section.fail(key, fmt::format("found [{}], expected [low, high], low below high", fmt::join(ends, ", ")));
    return std::nullopt;
  }
  return Range{ends[0] * unit, ends[1] * unit};
}

std::string separators_problem(const std::string& separators) {
  constexpr const char* kExpected = "expected the characters between two columns, such as \",;\\t\"";
  if (separators.empty()) return fmt::format("is empty, {}", kExpected);
  const bool in_numbers = std::any_of(separators.begin(), separators.end(),
                                      [](unsigned char c) { return std::isalnum(c) != 0 || c == '+' || c == '-'; });
  return in_numbers ? fmt::format("found \"{}\", {}", separators, kExpected) : std::string();
}

}  // namespace prism
