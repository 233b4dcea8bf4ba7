// SPDX-License-Identifier: MIT
// Draws a curve over time as text: braille dots (2 × 4 per character), or stars without UTF-8.
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

/// Range of the settled values in the frame's time (of all values if none is settled), so that the noisy means of a
/// window that is not full do not set the scale.
Bounds bounds_of(const std::deque<TracePoint>& points, double TracePoint::*value, const ChartFrame& frame);

/// Returns a range with the same centre, and at least `span` high.
Bounds widened(Bounds bounds, double span);

/// Returns `rows` lines, with the scale at the left (its largest value at the first line, its smallest at the last). A
/// column shows the mean of its values. Values outside the range are drawn at the edge. Columns without values are
/// gaps.
std::vector<std::string> chart(const std::deque<TracePoint>& points, double TracePoint::*value, const Bounds& bounds,
                               const ChartFrame& frame);

/// One line below a chart: "-10 min … -5 min … now". `end` names the right edge.
std::string time_axis(const ChartFrame& frame, const std::string& end);

}  // namespace prism::screen
