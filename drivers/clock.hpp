// SPDX-License-Identifier: MIT
// Assigns times to readings: unwraps the counter, counts missing frames, removes arrival jitter. Never waits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "compensation/sample.hpp"
#include "drivers/arrival_check.hpp"
#include "drivers/counter.hpp"
#include "drivers/wire/decode/decoded_message.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::drivers {

// Lower convex hull of arrival times: estimates the device clock through a line that only adds delay.

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

enum class ClockSource {
  kHost,    ///< arrival times of this machine, de-jittered by the device's counter
  kDevice,  ///< first arrival + counter x nominal tick: fast replays, and devices with an accurate clock
};

struct ClockSettings {
  ClockSource source = ClockSource::kHost;
  double switch_s = 100;            ///< host: the two windows of the fit alternate after this many seconds; 10 to 3600
  double residual_limit_s = 0.020;  ///< host: largest distance of a reading from the line, see Clock; > 0
  /// False for raw bytes, whose arrival times are computed from their number; then (device) only the counter counts.
  bool arrivals_are_measured = true;
  /// Marks samples if frames arrive at another rate than described. False for a simulated gyro that runs faster.
  bool check_frame_rate = true;
  /// An accumulated angle may have wrapped unseen after half a wrap at this rate; > 0.
  double max_rate_deg_per_h = 3.6e7;
  /// Longest interval over which the difference of two accumulated angles is a rate, s, unless frames come more slowly.
  double max_difference_s = 2;
};

struct ClockStatus {
  std::uint64_t samples = 0;  ///< readings that gave a sample on at least one axis
  std::uint64_t missing_frames = 0;
  std::uint64_t missing_by_arrival = 0;  ///< of these: derived from arrival times, because the counter may have wrapped
  std::uint64_t duplicates = 0;          ///< frames with the counter of the frame before: no sample
  std::uint64_t resets = 0;  ///< new starts from an arrival time, because counter and arrivals disagree (not reset())
  double period_s = 0;       ///< the frame period in use: estimated (host) or nominal
  bool period_is_estimated = false;  ///< false: still the nominal one
  double residual_s = 0;             ///< host: delay of the last frame relative to the fitted line
};

/// Takes one reading and returns at most one sample per axis. The time of a sample is the end of the interval over
/// which its rate is the mean.
///
/// Host: the counter gives the device's time x, the arrival (minus wire time and latency) the host's time y. The line
/// below all points (LowerHull) converts x to stamps and gives the true period. The nominal rate is used until
/// the window is long enough to estimate the rate better than the nominal rate's tolerance. Two windows alternate, so
/// that the line always uses the last one to two times switch_s. A reading that is earlier than the line by more than
/// the limit, or readings that are all later by more than the limit for a second, show that the counter or a clock was
/// set: the fit restarts (not counted as a reset within the first second, in which the first readings may be late). If
/// all readings are late by full periods of the counter (by frames, without a counter), frames were lost while the line
/// was not read: they are counted as missing by arrival, and the fit continues.
///
/// Device: first arrival + counter x nominal tick. A session with a new first arrival begins if the counter goes back
/// by less than half its modulus (the device restarted), and if device time and arrivals disagree (DeviceTimeCheck).
///
/// Without a counter (in this stream) each frame is one period after the previous one; a frame whose check failed is a
/// lost frame, other bytes are not.
///
/// An accumulated angle gives no sample if its difference is unknown: for the first reading of an axis, and after a gap
/// of more than max_difference_s or in which the angle may have wrapped. docs/frames.md has all rules.
class Clock {
 public:
  Clock(wire::FrameDescriptionPtr description, ClockSettings settings = {});

  /// Computes the time of the reading. Returns false for a repeated frame, a message without gyro data and a frame
  /// whose time is uncertain (DeviceTimeCheck; counted as missing), which give no sample.
  bool push(const wire::DecodedMessage& reading);
  /// True if the last push() began a session, because the device's time before it is not comparable.
  bool began_session() const { return began_session_; }
  /// The sample of an axis (index into FrameDescription::axes) of the reading last accepted by push(). Call exactly
  /// once for each: it consumes the axis's missing frames and angle. Returns nullopt if the rate or its interval is
  /// unknown.
  std::optional<Sample> sample(const wire::DecodedMessage& reading, std::size_t axis);

  /// The line was reopened: a new session. Stamps may start at any time.
  void reset();

  const ClockStatus& status() const { return status_; }
  /// Described times compared with arrivals, which never differ if that is not checked (ClockSettings), and rates.
  const FrameRateCheck& rate_check() const { return rate_check_; }

 private:
  void start(const wire::DecodedMessage& reading);
  void forget_angles();
  void miss(const CounterStep& step);
  std::optional<std::int64_t> stamp_device(const wire::DecodedMessage& reading, const CounterStep& step);
  std::int64_t stamp_host(const wire::DecodedMessage& reading, const CounterStep& step);
  bool out_of_step(double residual_s, double y, std::uint32_t behind);
  bool recount(double& residual_s);
  void fit(double y, double residual_s);
  std::optional<double> difference(const wire::AxisReading& reading, std::size_t axis, double& nominal_s);
  std::optional<double> angle_difference(const wire::AxisReading& reading, std::size_t axis, double& nominal_s);
  std::int64_t measured_ns(const wire::DecodedMessage& reading) const;

  wire::FrameDescriptionPtr description_;
  ClockSettings settings_;
  CounterUnwrapper steps_;
  ClockStatus status_;
  double tick_s_ = 0;                  ///< nominal
  std::int64_t milliticks_per_s_ = 0;  ///< of the device clock; 0: not an integer
  double byte_time_ns_ = 0;

  bool running_ = false;
  std::int64_t begin_ns_ = 0;      ///< of the session: its first reading
  std::int64_t origin_ns_ = 0;     ///< host time where x and y are 0
  double ticks_ = 0;               ///< unwrapped, since origin
  double x_ = 0;                   ///< the same in nominal seconds
  std::int64_t last_time_ns_ = 0;  ///< of the last stamp; goes back only with a session, or if a clock was set

  LowerHull active_, next_;
  double next_since_x_ = 0;
  double jitter_s_ = 0;  ///< largest delay of arrivals above the line
  std::uint64_t points_ = 0;
  double late_since_y_ = -1;  ///< since when every arrival is over the limit; negative: the last was not
  double least_late_s_ = 0;   ///< minimum delay in this time
  double slope_ = 1;          ///< estimated host seconds per nominal device second

  struct AxisState {
    std::uint32_t missing = 0;  ///< frames lost since its last sample
    double x = 0;               ///< of the last reading with this axis
    bool has_angle = false;     ///< accumulated: a previous angle is known
    double angle = 0;
    double angle_x = 0;
    double usual_s = 0;    ///< shortest interval between two readings with this axis
    double longest_s = 0;  ///< accumulated: no difference over a longer interval, except the usual one
  };
  std::vector<AxisState> axes_;  ///< as FrameDescription::axes
  DeviceTimeCheck device_check_;
  FrameRateCheck rate_check_;
  double gyro_x_ = 0;  ///< of the last frame with gyro data
  double last_y_ = 0;  ///< device: arrival of the last frame, s since origin
  bool began_session_ = false;
  bool counted_ = false;  ///< the last reading is counted in ClockStatus::samples
};

}  // namespace prism::drivers
