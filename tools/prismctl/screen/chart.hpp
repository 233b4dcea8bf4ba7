// SPDX-License-Identifier: MIT
// A curve over time in text: braille dots (2 × 4 a character), or stars where the terminal has no UTF-8.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "tools/prismctl/screen/trace.hpp"

namespace prism::screen {

/// Columns left of the plotting area: the scale and its line.
inline constexpr int kScaleColumns = 12;

struct ChartFrame {
  int columns = 60, rows = 8;      ///< characters of the plotting area, >= 2
  double begin_s = 0, end_s = 60;  ///< data time of its left and its right edge
  bool utf8 = true;
};

struct Bounds {
  double low = 0, high = 0;
  bool known = false;  ///< false: there is no value
};

/// Of the values within the frame's time that are settled; of all of them where none is: the warm-up of a window, a
/// mean of a few pulses, does not squash what comes after it.
Bounds bounds_of(const std::deque<TracePoint>& points, double TracePoint::*value, const ChartFrame& frame);

/// The same middle, `span` high at least.
Bounds widened(Bounds bounds, double span);

/// `rows` lines, the scale at the left, its highest and lowest value at their lines. A column is the mean of its
/// values; what is off the bounds stands at the edge; where no value is, there is a hole.
std::vector<std::string> chart(const std::deque<TracePoint>& points, double TracePoint::*value, const Bounds& bounds,
                               const ChartFrame& frame);

/// One line below a chart: "-10 min … -5 min … now". `end` names the right edge.
std::string time_axis(const ChartFrame& frame, const std::string& end);

}  // namespace prism::screen
