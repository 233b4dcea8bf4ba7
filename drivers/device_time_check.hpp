// SPDX-License-Identifier: MIT
// Compares the device's time with arrival times (clock "device").
#pragma once

#include <optional>

namespace prism::drivers {

/// The device's time x and the arrival y of the same frames, both in s since the first frame. They disagree
/// - if a step of x leads: the frame would have arrived before it was measured. Compared with the fastest of the last
///   10 to 20 s, because a simulated gyro may run at a multiple of real time;
/// - if x has been late by more than a second, for more than a second, and ran within 5 % of real time before: time
///   passed that the counter does not show. A reader that was late catches up within a second.
/// After more than 10 s without a frame, the next frames decide between the two: frames that waited on the way arrive
/// faster than they were measured. Until then, for 0.2 s at most, their time is uncertain.
/// Nothing is known in the first second.
class DeviceTimeCheck {
 public:
  enum class Verdict { kAgrees, kDisagrees, kUncertain };

  /// x and y are 0 now.
  void begin() { *this = {}; }
  /// The next frame. After kDisagrees, begin() must follow. `waited`: its bytes waited to be read.
  Verdict push(double x, double y, bool waited);

 private:
  struct Point {
    double x = 0, y = 0;
  };
  bool leads(double x, double y) const;
  Verdict after_gap(double x, double y);
  Verdict lateness(double x, double y, bool waited);
  void keep(double x, double y);

  Point anchor_, next_anchor_, last_;
  std::optional<Point> after_gap_;  ///< first frame after a long gap, while the time is uncertain
  double rate_ = 0;                 ///< device seconds per second of the window before; 0: not known yet
  double late_since_y_ = -1;        ///< negative: the last frame was not late
};

}  // namespace prism::drivers
