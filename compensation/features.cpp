// SPDX-License-Identifier: MIT
#include "compensation/features.hpp"

#include <algorithm>
#include <optional>
#include <string_view>

#include "base/text_number.hpp"

namespace prism::compensation {
namespace {

// "lag2" → 1; nullopt for any other name.
std::optional<std::size_t> lag_index(const std::string& name) {
  if (name.rfind("lag", 0) != 0 || name[3] == '0') return std::nullopt;  // one name per input: no "lag01"
  const auto number = parse_number<std::size_t>(std::string_view(name).substr(3));
  return number ? std::optional(*number - 1) : std::nullopt;
}

/// The parsed name of an input.
struct InputTerm {
  enum class Kind { kMean, kSlope, kLag, kDifference } kind = Kind::kMean;
  std::string first, second;  // quantities: T, U or a sensor
  std::size_t lag = 0;
};

std::optional<InputTerm> parse_term(const std::string& name) {
  if (name == kInputSlope) return InputTerm{InputTerm::Kind::kSlope, kInputTemperature, "", 0};
  if (const auto lag = lag_index(name)) return InputTerm{InputTerm::Kind::kLag, kInputTemperature, "", *lag};
  const auto is_quantity = [](const std::string& text) {
    return text == kInputTemperature || text == kInputUhfo || is_sensor_name(text);
  };
  if (is_quantity(name)) return InputTerm{InputTerm::Kind::kMean, name, "", 0};
  if (name.size() > 4 && name.front() == 'd' && name.ends_with("/dt")) {
    const std::string sensor = name.substr(1, name.size() - 4);
    return is_sensor_name(sensor) ? std::optional(InputTerm{InputTerm::Kind::kSlope, sensor, "", 0}) : std::nullopt;
  }
  if (const std::size_t colon = name.find(':'); colon != std::string::npos) {
    const auto lag = lag_index(name.substr(0, colon));
    const std::string sensor = name.substr(colon + 1);
    return lag && is_sensor_name(sensor) ? std::optional(InputTerm{InputTerm::Kind::kLag, sensor, "", *lag})
                                         : std::nullopt;
  }
  const std::size_t minus = name.find('-');
  if (minus == std::string::npos) return std::nullopt;
  const std::string first = name.substr(0, minus), second = name.substr(minus + 1);
  if (!is_quantity(first) || !is_quantity(second) || first == second) return std::nullopt;
  return InputTerm{InputTerm::Kind::kDifference, first, second, 0};
}

/// True if the definition has the quantity.
std::string unit_of(const FeatureDefinition& definition, const std::string& quantity) {
  if (quantity == kInputTemperature) return "degC";
  if (quantity == kInputUhfo) return "V";
  const std::size_t index = sensor_index(definition.sensors, quantity);
  return index < definition.sensors.size() ? definition.sensors[index].unit : "";
}

}  // namespace

int history_s(const FeatureDefinition& definition) {
  const bool difference = definition.slope == SlopeMethod::kDifference;
  return definition.length_s + (difference ? definition.end_mean_s : 0);
}

bool is_slope(const std::string& input) {
  const auto term = parse_term(input);
  return term && term->kind == InputTerm::Kind::kSlope;
}

std::vector<std::string> sensors_of(const std::vector<std::string>& inputs) {
  std::vector<std::string> sensors;
  for (const std::string& input : inputs) {
    const auto term = parse_term(input);
    if (!term) continue;
    for (const std::string& name : {term->first, term->second}) {
      const bool known = std::find(sensors.begin(), sensors.end(), name) != sensors.end();
      if (is_sensor_name(name) && !known) sensors.push_back(name);
    }
  }
  return sensors;
}

bool has_input(const FeatureDefinition& definition, const std::string& name) {
  const auto term = parse_term(name);
  if (!term) return false;
  const auto known = [&](const std::string& quantity) {
    return quantity == kInputTemperature || quantity == kInputUhfo ||
           sensor_index(definition.sensors, quantity) < definition.sensors.size();
  };
  if (!known(term->first)) return false;
  switch (term->kind) {
    case InputTerm::Kind::kLag:
      return term->lag < definition.lag_time_constants_s.size();
    case InputTerm::Kind::kDifference:
      return known(term->second) && unit_of(definition, term->first) == unit_of(definition, term->second);
    default:
      return true;
  }
}

std::string unit_of_input(const FeatureDefinition& definition, const std::string& name) {
  const auto term = parse_term(name);
  if (!term) return "";
  return unit_of(definition, term->first) + (term->kind == InputTerm::Kind::kSlope ? "/s" : "");
}

double input_value(const Window& window, const FeatureDefinition& definition, const std::string& name) {
  if (name == kInputTemperature) return window.temperature_degc;
  if (name == kInputSlope) return window.slope_degc_per_s;
  if (name == kInputUhfo) return window.uhfo_v;
  const auto term = parse_term(name);
  if (!term) return kUnknown;
  const auto at = [](const std::vector<double>& values, std::size_t i) {
    return i < values.size() ? values[i] : kUnknown;
  };
  const auto sensor = [&](const std::string& quantity) -> const SensorWindow* {
    const std::size_t index = sensor_index(definition.sensors, quantity);
    return index < window.sensors.size() ? &window.sensors[index] : nullptr;
  };
  const auto mean = [&](const std::string& quantity) {
    if (quantity == kInputTemperature) return window.temperature_degc;
    if (quantity == kInputUhfo) return window.uhfo_v;
    const SensorWindow* const own = sensor(quantity);
    return own ? own->mean : kUnknown;
  };
  const SensorWindow* const own = sensor(term->first);
  switch (term->kind) {
    case InputTerm::Kind::kMean:
      return mean(term->first);
    case InputTerm::Kind::kSlope:
      return own ? own->slope_per_s : kUnknown;
    case InputTerm::Kind::kLag:
      if (term->first == kInputTemperature) return at(window.lag_degc, term->lag);
      return own ? at(own->lag, term->lag) : kUnknown;
    case InputTerm::Kind::kDifference:
      return mean(term->first) - mean(term->second);
  }
  return kUnknown;
}

}  // namespace prism::compensation
