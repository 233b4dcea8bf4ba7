// SPDX-License-Identifier: MIT
// A thermal record: soaks, heating and cooling, and the hysteresis between heating and cooling.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::evaluation {

enum class ThermalKind { kSoak, kHeating, kCooling };

const char* thermal_kind_text(ThermalKind kind);

/// Blocks [begin, end).
struct ThermalSegment {
  ThermalKind kind = ThermalKind::kSoak;
  std::size_t begin = 0, end = 0;
  double mean_temperature_degc = 0;
  double first_temperature_degc = 0, last_temperature_degc = 0;

  std::size_t size() const { return end - begin; }
};

struct ThermalSegmentSettings {
  /// A smaller slope is a soak. 0.1 degC/min: a tenth of the usual chamber ramp.
  double soak_slope_degc_per_s = 0.1 / 60;
  std::size_t min_blocks = 3;  ///< shorter segments join the one before
};

/// The type of every block, from the slope between its neighbours; at the ends from the one neighbour.
std::vector<ThermalKind> thermal_kinds(std::span<const double> time_s, std::span<const double> temperature_degc,
                                       double soak_slope_degc_per_s);

/// Segments that cover all blocks in order. Errors: fewer than two blocks, different lengths, times that do not
/// increase, temperatures that are not finite.
Result<std::vector<ThermalSegment>> cut_thermal_segments(std::span<const double> time_s,
                                                         std::span<const double> temperature_degc,
                                                         const ThermalSegmentSettings& settings,
                                                         const std::string& where);

/// Hysteresis: the largest difference between the mean bias while heating and while cooling, over bins of temperature
/// with both. `kinds` are from thermal_kinds(); soaks and unknown values are ignored. Nullopt: no bin has both.
std::optional<double> largest_gap(std::span<const double> temperature_degc, std::span<const double> bias_deg_per_h,
                                  std::span<const ThermalKind> kinds, double bin_degc);

}  // namespace prism::evaluation
