// SPDX-License-Identifier: MIT
#include "compensation/features.hpp"

#include <charconv>
#include <optional>

namespace prism::compensation {
namespace {

// "lag2" → 1; nothing for any other name.
std::optional<std::size_t> lag_index(const std::string& name) {
  if (name.rfind("lag", 0) != 0 || name[3] == '0') return std::nullopt;  // one name for each input: no "lag01"
  std::size_t number = 0;
  const char* end = name.data() + name.size();
  const auto [stop, error] = std::from_chars(name.data() + 3, end, number);
  if (error != std::errc() || stop != end) return std::nullopt;
  return number - 1;
}

}  // namespace

int history_s(const FeatureDefinition& definition) {
  const bool difference = definition.slope == SlopeMethod::kDifference;
  return definition.length_s + (difference ? definition.end_mean_s : 0);
}

bool has_input(const FeatureDefinition& definition, const std::string& name) {
  if (name == kInputTemperature || name == kInputSlope || name == kInputUhfo) return true;
  const auto lag = lag_index(name);
  return lag && *lag < definition.lag_time_constants_s.size();
}

double input_value(const Window& window, const std::string& name) {
  if (name == kInputTemperature) return window.temperature_degc;
  if (name == kInputSlope) return window.slope_degc_per_s;
  if (name == kInputUhfo) return window.uhfo_v;
  const auto lag = lag_index(name);
  return lag && *lag < window.lag_degc.size() ? window.lag_degc[*lag] : kUnknown;
}

}  // namespace prism::compensation
