// SPDX-License-Identifier: MIT
// A thermal record: soaks, heating and cooling, and the hysteresis between heating and cooling.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace prism::evaluation {

enum class ThermalKind { kSoak, kHeating, kCooling };

const char* thermal_kind_text(ThermalKind kind);

/// Blocks [begin, end).
struct ThermalSegment {
  ThermalKind kind = ThermalKind::kSoak;
  std::size_t begin = 0, end = 0;

  std::size_t size() const { return end - begin; }
};

/// A smaller slope is a soak. 0.1 degC/min: a tenth of the usual chamber ramp.
inline constexpr double kSoakSlope_degc_per_s = 0.1 / 60;

/// The type of every block, from the slope between its neighbours; at the ends from the one neighbour.
std::vector<ThermalKind> thermal_kinds(std::span<const double> time_s, std::span<const double> temperature_degc,
                                       double soak_slope_degc_per_s);

/// Segments that cover all blocks in order, from thermal_kinds(). Those of fewer than three blocks join the one before.
std::vector<ThermalSegment> thermal_segments(std::span<const ThermalKind> kinds);

/// Hysteresis: the largest difference between the mean bias while heating and while cooling, over bins of temperature
/// with both. `kinds` are from thermal_kinds(); soaks and unknown values are ignored. Nullopt: no bin has both.
std::optional<double> largest_gap(std::span<const double> temperature_degc, std::span<const double> bias_deg_per_h,
                                  std::span<const ThermalKind> kinds, double bin_degc);

}  // namespace prism::evaluation
