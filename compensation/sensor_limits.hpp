// SPDX-License-Identifier: MIT
// What a frame description or a configuration states of a sensor: what it can say, and how fast it can change.
#pragma once

#include <optional>

#include "base/json_section.hpp"

namespace prism {

/// What is left out stays as it was before.
struct SensorStatement {
  std::optional<Range> range;  ///< closed; in deg/h, degC or V
  std::optional<double> greatest_slope_per_s;
  std::optional<double> stuck_s;  ///< a value that stands still for longer is not believed

  bool operator==(const SensorStatement& other) const;
};

struct SensorStatements {
  SensorStatement rate, temperature, uhfo;
  bool operator==(const SensorStatements&) const = default;
};

/// The key of a range, [low, high], two numbers within `allowed`, low below high; one of them is `unit` of the
/// statement's. Absent: none.
std::optional<Range> read_range(const Section& section, const char* key, Range allowed, double unit = 1);

/// The key of a greatest slope, 1e-6 to 1e6. Absent: none.
std::optional<double> read_greatest_slope(const Section& section, const char* key);

/// What ranges may hold, in deg/s, and in degC or V.
inline constexpr Range kRateRanges{-1e9, 1e9}, kChannelRanges{-1e6, 1e6};
inline constexpr double kDegPerSInDegPerH = 3600;

}  // namespace prism
