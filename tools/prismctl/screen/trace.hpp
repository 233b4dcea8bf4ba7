// SPDX-License-Identifier: MIT
// Data of the live screen's charts: the window's means of the last day.
#pragma once

#include <deque>
#include <nlohmann/json.hpp>

namespace prism::screen {

struct TracePoint {
  double time_s;               ///< data time
  double raw_deg_per_h;        ///< the window's mean; NaN where unknown
  double corrected_deg_per_h;  ///< the same, corrected; NaN where unknown
  bool settled;                ///< false: the window was not full
};

/// In order of time, at most one day. A row that is older than the last one (after a clock step, or when history is
/// read again) replaces all points from its time on.
class Trace {
 public:
  /// `row`: the params of a window notification. `window_s`: length of the window's means.
  void push(const nlohmann::json& row, int window_s);
  const std::deque<TracePoint>& points() const { return points_; }

 private:
  std::deque<TracePoint> points_;
  double run_begin_s_ = 0;  ///< begin of the rows without a gap
};

}  // namespace prism::screen
