// SPDX-License-Identifier: MIT
// What the live screen draws: the window's means of the last day, with their times.
#pragma once

#include <deque>
#include <nlohmann/json.hpp>

namespace prism::screen {

struct TracePoint {
  double time_s;               ///< data time
  double raw_deg_per_h;        ///< the window's mean; NaN where unknown
  double corrected_deg_per_h;  ///< the same, corrected; NaN where unknown
  bool settled;                ///< false: the window was filling, its mean is of fewer seconds
};

/// In order of time, at most a day of it: a row of an older time (a clock was set, or history is read again) replaces
/// what stood from there on.
class Trace {
 public:
  /// `row`: the params of a window notification. `window_s`: length of the window's means.
  void push(const nlohmann::json& row, int window_s);
  const std::deque<TracePoint>& points() const { return points_; }

 private:
  std::deque<TracePoint> points_;
  double run_begin_s_ = 0;  ///< since when rows came without a gap
};

}  // namespace prism::screen
