// SPDX-License-Identifier: MIT
// Hysteresis: the difference of the bias between heating and cooling at the same temperature.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/evaluation/thermal_segments.hpp"

namespace prism::evaluation {

/// One temperature bin with heating and cooling blocks.
struct HysteresisBin {
  double temperature_degc = 0;  ///< its centre
  double heating_deg_per_h = 0, cooling_deg_per_h = 0;
  double gap_deg_per_h() const { return heating_deg_per_h - cooling_deg_per_h; }
};

struct Hysteresis {
  std::vector<HysteresisBin> bins;  ///< by temperature; only bins with heating and cooling blocks
  double bin_degc = 0;
  double max_gap_deg_per_h = 0;  ///< largest |gap|
  double max_gap_at_degc = 0;
  double loop_area_deg_per_h_degc = 0;  ///< Σ |gap| · bin width
  /// Slope of the least-squares line bias against T over all heating (cooling) blocks, deg/h/degC; nullopt if the
  /// record has fewer than three such blocks, or they have the same temperature.
  std::optional<double> heating_sensitivity, cooling_sensitivity;
};

/// `kinds` are from thermal_kinds(); soak blocks are ignored. Without a bin that has heating and cooling blocks, bins
/// are empty and values zero. Errors: different lengths, bin_degc not positive, values that are not finite.
Result<Hysteresis> measure_hysteresis(std::span<const double> temperature_degc, std::span<const double> bias_deg_per_h,
                                      std::span<const ThermalKind> kinds, double bin_degc, const std::string& where);

}  // namespace prism::evaluation
