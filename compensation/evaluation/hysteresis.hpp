// SPDX-License-Identifier: MIT
// How differently a gyro behaves at the same temperature while it warms and while it cools.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/evaluation/thermal_segments.hpp"

namespace prism::evaluation {

/// One bin of temperature that was passed both ways.
struct HysteresisBin {
  double temperature_degc = 0;  ///< its centre
  double heating_deg_per_h = 0, cooling_deg_per_h = 0;
  double gap_deg_per_h() const { return heating_deg_per_h - cooling_deg_per_h; }
};

struct Hysteresis {
  std::vector<HysteresisBin> bins;  ///< by temperature; only those with heating and cooling blocks
  double bin_degc = 0;
  double max_gap_deg_per_h = 0;  ///< largest |gap|
  double max_gap_at_degc = 0;
  double loop_area_deg_per_h_degc = 0;  ///< Σ |gap| · bin width
  /// Slope of the least-squares line bias against T over all heating (cooling) blocks, deg/h/degC; nothing where the
  /// record has fewer than three such blocks, or they share one temperature.
  std::optional<double> heating_sensitivity, cooling_sensitivity;
};

/// `kinds` as thermal_kinds gives them; soak blocks take no part. A record that never passes a bin both ways gives no
/// bins and zeros. Refused: lengths that differ, bin_degc not positive, values not finite.
Result<Hysteresis> measure_hysteresis(std::span<const double> temperature_degc, std::span<const double> bias_deg_per_h,
                                      std::span<const ThermalKind> kinds, double bin_degc, const std::string& where);

}  // namespace prism::evaluation
