// SPDX-License-Identifier: MIT
// Limits of a sensor in a frame description or a configuration: range and slope.
#pragma once

#include <optional>

#include "base/json_section.hpp"

namespace prism {

/// Settings without a value do not change the earlier one.
struct SensorStatement {
  std::optional<Range> range;  ///< closed; in deg/h, degC or V
  std::optional<double> greatest_slope_per_s;
  std::optional<double> stuck_s;  ///< a value that is constant for longer is rejected

  bool operator==(const SensorStatement& other) const;
};

struct SensorStatements {
  SensorStatement rate, temperature, uhfo;
  bool operator==(const SensorStatements&) const = default;
};

/// The key of a range, [low, high]: two numbers within `allowed`, low below high; `unit` is the unit of the statement.
/// Returns none if absent.
std::optional<Range> read_range(const Section& section, const char* key, Range allowed, double unit = 1);

/// The key of a maximum slope, 1e-6 to 1e6. Returns none if absent.
std::optional<double> read_greatest_slope(const Section& section, const char* key);

/// Allowed values of ranges, in deg/s, and in degC or V.
inline constexpr Range kRateRanges{-1e9, 1e9}, kChannelRanges{-1e6, 1e6};
inline constexpr double kDegPerSInDegPerH = 3600;

}  // namespace prism
