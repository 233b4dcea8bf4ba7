// SPDX-License-Identifier: MIT
// Compares the device's time with arrival times (clock "device").
#pragma once

namespace prism::drivers {

/// The device's time x and the arrival y of the same frames, both in s since the first frame. They disagree
/// - if a step of x leads: the frame would have arrived before it was measured. Compared with the fastest of the last
///   10 to 20 s, because a simulated gyro may run at a multiple of real time;
/// - if x has been late by more than a second, for more than a second, and ran within 5 % of real time before: time
///   passed that the counter does not show. A reader that was late catches up within a second. After 10 s without a
///   frame it is not waited for.
/// Nothing is known in the first second.
class DeviceTimeCheck {
 public:
  /// x and y are 0 now.
  void begin() { *this = {}; }
  /// Returns false if the next frame disagrees; then begin() must follow. `waited`: its bytes waited to be read.
  bool agrees(double x, double y, bool waited);

 private:
  struct Point {
    double x = 0, y = 0;
  };
  bool leads(double x, double y) const;
  bool is_late(double x, double y, bool waited);
  void keep(double x, double y);

  Point anchor_, next_anchor_, last_;
  double rate_ = 0;           ///< device seconds per second of the window before; 0: not known yet
  double late_since_y_ = -1;  ///< negative: the last frame was not late
};

}  // namespace prism::drivers
