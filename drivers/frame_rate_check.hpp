// SPDX-License-Identifier: MIT
// Compares the described rate of frames with their arrivals and time tags.
#pragma once

#include <limits>

namespace prism::drivers {

/// The description's time x (counter ticks, or frames of the nominal period) and the arrival y of the same frames, both
/// in s from any origin. They differ if, over the last 100 to 200 s of arrivals (at least 10 s after a start), they
/// differ by more than 1 % (or the gyro's own tolerance) and by more than 1 s beyond the longest pause of the arrivals,
/// in which frames can have been lost or delayed. A jump of x by a second more than the arrivals is a counter that was
/// set: the comparison restarts.
///
/// With time tags x does not follow from the rate of the frames. This rate is wrong if, over 30 s of x and at least 10
/// frames, the usual step from one frame to the next differs from the described one by more than 10 %. The usual step
/// is that of the frames which follow without a lost one, unless these are less than half of all.
class FrameRateCheck {
 public:
  /// `tolerance`: of the described rate, relative; at least 1 % is used. `rate_hz`: of frames with gyro data, for time
  /// tags of `tick_s`.
  FrameRateCheck(double tolerance, double rate_hz, double tick_s);

  /// A new session: the times before it do not count. The result stays until there is another one.
  void begin();
  /// `step`: increase of x since the frame before.
  void push(double step, double y);
  /// A frame with gyro data and a time tag; `step`: increase of x since the one before, > 0.
  void push_tagged(double step);

  bool differs() const { return differs_; }
  /// Increase of x per second of arrivals, at the last comparison; 0: not known yet.
  double ratio() const { return ratio_; }
  /// Frames with gyro data per second of their time tags, if this is not the described rate; else 0.
  double tagged_hz() const { return tagged_hz_; }

 private:
  struct Window {
    double x = 0, y = 0;   ///< at its begin
    double longest_s = 0;  ///< longest pause of the arrivals since then
  };
  struct Steps {
    double seconds = 0, count = 0;
    void add(double step) { seconds += step, ++count; }
  };
  void compare();

  double tolerance_, rate_hz_;
  double longest_step_s_;  ///< a longer one contains a lost frame
  bool differs_ = false;
  double ratio_ = 0, tagged_hz_ = 0;
  double x_ = 0, y_ = std::numeric_limits<double>::infinity();  ///< infinity: the next frame is the first
  double compared_y_ = 0;
  Window older_, newer_;
  Steps all_, without_loss_;
};

}  // namespace prism::drivers
