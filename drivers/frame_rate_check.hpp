// SPDX-License-Identifier: MIT
// Compares the time that the frames stand for, by their description, with arrival times.
#pragma once

namespace prism::drivers {

/// The description's time x (counter ticks, or frames of the nominal period) and the arrival y of the same frames, both
/// in s from any origin. They differ if, over the last 100 to 200 s of arrivals (at least 10 s after a start), they
/// differ by more than 1 % (or the gyro's own tolerance) and by more than 1 s beyond the longest pause of the arrivals,
/// in which frames can have been lost or delayed. A jump of x by a second more than the arrivals is a counter that was
/// set: the comparison restarts.
class FrameRateCheck {
 public:
  /// `tolerance`: of the described rate, relative; at least 1 % is used.
  explicit FrameRateCheck(double tolerance = 0);

  /// A new session: the times before it do not count. The result stays until there is another one.
  void begin() { running_ = false; }
  /// `step`: increase of x since the frame before.
  void push(double step, double y);

  bool differs() const { return differs_; }
  /// Increase of x per second of arrivals, at the last comparison; 0: not known yet.
  double ratio() const { return ratio_; }

 private:
  struct Window {
    double x = 0, y = 0;   ///< at its begin
    double longest_s = 0;  ///< longest pause of the arrivals since then
  };
  void compare();

  double tolerance_;
  bool running_ = false, differs_ = false;
  double ratio_ = 0;
  double x_ = 0, y_ = 0, compared_y_ = 0;
  Window older_, newer_;
};

}  // namespace prism::drivers
