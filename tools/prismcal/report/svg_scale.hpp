// SPDX-License-Identifier: MIT
// An axis of a drawing: its range, conversion of values to pixels, and ticks.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

struct Range {
  double low = HUGE_VAL, high = -HUGE_VAL;  ///< low > high: empty
  void add(double value);
};

/// Returns false for NaN, infinite values, values so large that differences overflow, and values ≤ 0 on a logarithmic
/// axis.
bool is_drawable(double value, bool logarithmic);

/// Returns the edges of the cells around grid values: half-way between neighbours, and as far outside at both ends.
/// Empty if there are fewer than two different values.
std::vector<double> grid_edges(std::vector<double> values);

/// Prints up to two decimals, limited to ±20000; 0 for NaN.
std::string svg_number(double pixels);

struct Tick {
  double at_px;
  std::string label;  ///< content of an SVG text element: digits, or 10 with a raised exponent
};

class Scale {
 public:
  /// `low_px`, `high_px`: pixels of both ends. `room_px`: minimum distance of ticks. `extend`: extends the range to the
  /// next ticks, except at an end that `axis` fixes. If `data` is empty, the range is 0 to 1, or 1 to 10.
  Scale(const Axis& axis, Range data, double low_px, double high_px, double room_px, bool extend);

  bool shows(double value) const { return is_drawable(value, logarithmic_); }
  /// `value` must be drawable.
  double px(double value) const { return at(logarithmic_ ? std::log10(value) : value); }
  /// Base of bars: zero, or the lower end of a logarithmic axis.
  double base_px() const { return logarithmic_ ? low_px_ : px(0); }
  bool is_logarithmic() const { return logarithmic_; }
  const std::vector<Tick>& ticks() const { return ticks_; }
  /// Ticks without labels: 2 to 9 times the powers of ten on a logarithmic axis.
  const std::vector<double>& minor_px() const { return minor_px_; }

 private:
  double at(double position) const { return low_px_ + (position - low_) / (high_ - low_) * (high_px_ - low_px_); }
  void add_linear_ticks(double low, double high, double step);
  void add_powers(double step);
  void add_digits(double room_px);

  bool logarithmic_;
  double low_, high_;  // of log10 on a logarithmic axis
  double low_px_, high_px_;
  std::vector<Tick> ticks_{};
  std::vector<double> minor_px_{};
};

}  // namespace prism::report
