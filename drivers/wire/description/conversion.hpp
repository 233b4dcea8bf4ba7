// SPDX-License-Identifier: MIT
// Converts a number on the wire to its quantity: linear, table, bridge, PT100.
#pragma once

#include <cstddef>
#include <variant>
#include <vector>

namespace prism::wire {

/// Linear interpolation between points (x strictly increasing, y strictly monotonic); NaN outside the first and last.
struct TableStep {
  std::vector<double> x, y;
};

/// Ratiometric bridge: y = reference x / (full - x), x from 0 to below full.
struct BridgeStep {
  double full = 1;
  double reference = 1;
};

/// Platinum resistor, IEC 60751: x ohm in, degC out, -200 to 850 degC; NaN outside.
struct PlatinumStep {
  double r0_ohm = 100;
};

using ConversionStep = std::variant<TableStep, BridgeStep, PlatinumStep>;

/// One step forward; NaN if x is outside the range of the step.
double convert(const ConversionStep& step, double x);
/// The x that convert() maps to y; NaN if there is no such x.
double convert_back(const ConversionStep& step, double y);

/// IEC 60751: resistance of a platinum resistor at a temperature, and back (error below 1e-6 degC from -200 to 850).
double platinum_ohm(double temperature_degc, double r0_ohm);
double platinum_degc(double resistance_ohm, double r0_ohm);

/// number = raw * scale + offset, then the steps in order, then the range.
struct Conversion {
  double scale = 1;
  double offset = 0;
  double min = -1e300;  ///< of the result; outside, or if it is not finite, the value is unknown
  double max = 1e300;
  std::vector<ConversionStep> steps;

  /// Without the range check.
  double apply(double raw) const {
    double value = raw * scale + offset;
    for (const ConversionStep& step : steps) value = convert(step, value);
    return value;
  }
  /// Inverse of apply: the raw number, not rounded; NaN if it does not exist.
  double invert(double value) const {
    for (std::size_t i = steps.size(); i-- > 0;) value = convert_back(steps[i], value);
    return (value - offset) / scale;
  }
  bool admits(double value) const { return value >= min && value <= max; }
};

}  // namespace prism::wire
