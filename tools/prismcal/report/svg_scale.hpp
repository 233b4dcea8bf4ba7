// SPDX-License-Identifier: MIT
// An axis of a drawing: the values that it shows, the pixel of each value, and its ticks.
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

/// Returns false for values without a position: NaN, infinite or so large that differences overflow; on a logarithmic
/// axis also values that are not above zero.
bool is_drawable(double value, bool logarithmic);

/// The borders between the values of a sorted grid, half-way (in log10 if `logarithmic`), and as far out at both ends.
/// Empty if there are fewer than two different values.
std::vector<double> grid_edges(std::vector<double> values, bool logarithmic);

/// Up to two decimals, between -20000 and 20000; 0 for NaN.
std::string svg_number(double pixels);

struct Tick {
  double at_px;
  std::string label;  ///< content of an SVG text element: digits, or 10 with a raised exponent
};

class Scale {
 public:
  /// `low_px` and `high_px`: the pixels of both ends. `room_px`: the least distance of two ticks. `whole_steps`: the
  /// range grows to the next ticks, except at an end that `axis` fixes. An empty `data` gives a range of 0 to 1, or 1
  /// to 10.
  Scale(const Axis& axis, Range data, double low_px, double high_px, double room_px, bool whole_steps);

  bool shows(double value) const { return is_drawable(value, logarithmic_); }
  /// `value` must be drawable.
  double px(double value) const { return at(logarithmic_ ? std::log10(value) : value); }
  /// Where bars begin: zero, or the lower end of a logarithmic axis.
  double base_px() const { return logarithmic_ ? low_px_ : px(0); }
  bool is_logarithmic() const { return logarithmic_; }
  const std::vector<Tick>& ticks() const { return ticks_; }
  /// Ticks without labels: 2 to 9 times the powers of ten of a logarithmic axis.
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
