// SPDX-License-Identifier: MIT
// The straight line under all arrival times: what the device's clock says, seen through a line that only ever delays.
#pragma once

#include <cstddef>
#include <vector>

namespace prism::drivers {

/// A frame can arrive late, never early. So among the points (device time x, arrival time y) the true line lies under
/// all of them and touches those that were not delayed: it is an edge of their lower convex hull. The edge under the
/// middle of the window is taken (Zhang, Liu, Xia: Clock synchronization algorithms for network measurements, 2002; the
/// same choice as in ETH Zurich's cuckoo_time_translator). Amortised O(1) a point, O(log n) for the edge.
class ArrivalHull {
 public:
  struct StraightLine {
    double x0 = 0, y0 = 0;  ///< a point of the line
    double slope = 1;       ///< arrival seconds per device second
    double at(double x) const { return y0 + slope * (x - x0); }
  };

  /// x rises strictly from push to push; both in seconds from a near origin.
  void push(double x, double y);
  void clear();

  bool empty() const { return hull_.empty(); }
  double span() const { return hull_.empty() ? 0 : hull_.back().x - hull_.front().x; }
  /// The edge under the middle; before there are two points: slope 1 through the only one.
  StraightLine edge() const;
  /// The line of slope 1 under all points.
  StraightLine nominal() const { return {0, least_, 1}; }

 private:
  struct Point {
    double x, y;
  };
  void thin();

  std::vector<Point> hull_;
  double least_ = 0;  ///< of y - x
};

}  // namespace prism::drivers
