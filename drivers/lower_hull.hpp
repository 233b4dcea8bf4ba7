// SPDX-License-Identifier: MIT
// Lower convex hull of arrival times: estimates the device clock through a line that only adds delay.
#pragma once

#include <cstddef>
#include <vector>

namespace prism::drivers {

/// A frame can arrive late, never early. So the true line is below all points (device time x, arrival time y) and
/// touches those without delay: it is an edge of their lower convex hull. Uses the edge below the middle of the window
/// (Zhang, Liu, Xia: Clock synchronization algorithms for network measurements, 2002; also ETH Zurich's
/// cuckoo_time_translator). Amortised O(1) per point, O(log n) for the edge.
class LowerHull {
 public:
  struct StraightLine {
    double x0 = 0, y0 = 0;  ///< a point of the line
    double slope = 1;       ///< arrival seconds per device second
    double at(double x) const { return y0 + slope * (x - x0); }
  };

  /// x must increase strictly between calls; both in seconds from a close origin.
  void push(double x, double y);
  void clear();

  bool empty() const { return hull_.empty(); }
  double span() const { return hull_.empty() ? 0 : hull_.back().x - hull_.front().x; }
  /// The edge below the middle; nominal() with fewer than two points.
  StraightLine edge() const;
  /// The line of slope 1 below all points.
  StraightLine nominal() const { return {0, least_, 1}; }

 private:
  struct Point {
    double x, y;
  };
  void thin();

  std::vector<Point> hull_;
  double least_ = 0;  ///< minimum of y - x
};

}  // namespace prism::drivers
