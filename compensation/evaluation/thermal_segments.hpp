// SPDX-License-Identifier: MIT
// Cuts a thermal record into soaks, heating and cooling, so that each can be judged by itself.
#pragma once

#include <cstddef>
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

struct SegmentSettings {
  /// Below it a temperature stands still. 0.1 degC/min: a tenth of the usual chamber ramp.
  double soak_slope_degc_per_s = 0.1 / 60;
  std::size_t min_blocks = 3;  ///< shorter stretches join the one before
};

/// The kind of every block, from the slope between its neighbours; at the ends from the one neighbour there is.
std::vector<ThermalKind> thermal_kinds(std::span<const double> time_s, std::span<const double> temperature_degc,
                                       double soak_slope_degc_per_s);

/// Segments that cover all blocks in order. Refused: fewer than two blocks, lengths that differ, times that do not
/// increase, temperatures that are not finite.
Result<std::vector<ThermalSegment>> cut_thermal_segments(std::span<const double> time_s,
                                                         std::span<const double> temperature_degc,
                                                         const SegmentSettings& settings, const std::string& where);

}  // namespace prism::evaluation
