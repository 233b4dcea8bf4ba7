// SPDX-License-Identifier: MIT
// Assigns times to readings: checks and unwraps the counter, counts missing frames, removes arrival jitter. Never
// waits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "compensation/sample.hpp"
#include "drivers/wire/decode/message_decoder.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::drivers {

// The described rate of frames against their arrivals and time tags.

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

/// Device time x and arrival time y, s since a close origin.
struct TimePoint {
  double x = 0, y = 0;
};

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

  /// x must increase strictly between calls.
  void push(TimePoint point);

  bool empty() const { return hull_.empty(); }
  double span() const { return hull_.empty() ? 0 : hull_.back().x - hull_.front().x; }
  /// The edge below the middle; nominal() with fewer than two points.
  StraightLine edge() const;
  /// The line of slope 1 below all points.
  StraightLine nominal() const { return {0, least_, 1}; }

 private:
  std::vector<TimePoint> hull_;
  double least_ = 0;  ///< minimum of y - x
};

enum class ClockSource {
  kHost,    ///< arrival times of this machine, de-jittered by the device's counter
  kDevice,  ///< first arrival + counter x nominal tick: fast replays, and devices with an accurate clock
};

struct ClockSettings {
  ClockSource source = ClockSource::kHost;
  double switch_s = 100;  ///< host: the two windows of the fit alternate after this many seconds; 10 to 3600
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
  std::uint64_t rejected_counters = 0;   ///< frames that check_counter() rejected
  std::uint64_t resets = 0;  ///< new starts from an arrival time, because counter and arrivals disagree (not reset())
  double period_s = 0;       ///< the frame period in use: estimated (host) or nominal
  bool period_is_estimated = false;  ///< false: still the nominal one
  double residual_s = 0;             ///< host: delay of the last frame relative to the fitted line
};

/// Takes one reading and returns at most one sample per axis. The time of a sample is the end of the interval over
/// which its rate is the mean. The device's time x is the counter, unwrapped, in nominal ticks; the host's time y is
/// the arrival minus wire time and latency.
///
/// Host: the line below all points (LowerHull) converts x to stamps and gives the true period. The nominal rate is used
/// until the window is long enough to estimate the rate better than the nominal rate's tolerance. Two windows
/// alternate, so that the line always uses the last one to two times switch_s. A reading that is earlier than the line
/// by more than 20 ms, or readings that are all later by more than that for a second, show that the counter or a clock
/// was set: the fit restarts (not counted as a reset within the first second, in which the first readings may be late).
/// If all readings are late by full periods of the counter (by frames, without a counter), frames were lost while the
/// line was not read: they are counted as missing by arrival, and the fit continues. So are the full periods of the
/// counter in a gap of more than a second, unless the bytes after it had been waiting, in one large chunk.
///
/// Device: first arrival + counter x nominal tick. A session with a new first arrival begins if the counter goes back
/// by less than half its modulus (the device restarted; a counter of fewer than 64 frames cannot distinguish this from
/// loss), and if x and y disagree, which cannot be known in the first second:
/// - a step of x leads: the frame would have arrived before it was measured. Compared with the fastest of the last 10
///   to 20 s, because a simulated gyro may run at a multiple of real time;
/// - x has been late by more than a second, for more than a second, and ran within 5 % of real time before: time passed
///   that the counter does not show. A reader that was late catches up within a second.
/// After more than 10 s without a frame, the next frames decide between the two: frames that waited on the way arrive
/// faster than they were measured. Until then, for 0.2 s at most, their time is uncertain.
///
/// Without a counter (in this stream) each frame with gyro data is one period after the previous one, also one whose
/// check failed, which is lost. Other bytes are not, because a device may send anything between frames. An uncounted
/// frame between counted ones takes no step.
///
/// An accumulated angle gives no sample if its difference is unknown: for the first reading of an axis, and after a gap
/// of more than max_difference_s or in which the angle may have wrapped. docs/frames.md has all rules.
class Clock {
 public:
  Clock(wire::FrameDescriptionPtr description, ClockSettings settings = {});

  /// Calls `pass` with each reading that passes because of this one, in order: none, one or two. `pass` must push() it.
  /// A frame whose counter jumps by more than 4 frames, or back, is held until the next counted frame. It is rejected
  /// if the next counter lies between the one before the jump and its own: then the frame counts as lost. Otherwise the
  /// jump is real (lost frames, a restarted device) and both frames pass. Messages without the counter always pass.
  template <class Pass>
  void check_counter(const wire::DecodedMessage& reading, const Pass& pass) {
    if (!reading.has_counter || !last_counter_) return pass(reading);
    if (held_) {
      const wire::DecodedMessage held = *std::exchange(held_, std::nullopt);
      if (ticks_to(held) <= ticks_to(reading)) {
        pass(held);
      } else {
        ++status_.rejected_counters;
      }
    }
    if (ticks_to(reading) <= near_ticks_) return pass(reading);
    held_ = reading;
  }
  /// The session ends: returns the reading that is held, if any. push() it; then reset() must follow.
  std::optional<wire::DecodedMessage> take_held() { return std::exchange(held_, std::nullopt); }

  /// Computes the time of the reading. Returns false for a repeated frame, a message without gyro data and a frame
  /// whose time is uncertain (see the class; counted as missing), which give no sample.
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
  /// From the reading before.
  struct Step {
    double ticks = 0;              ///< of CounterRule; frames if the description has no counter
    std::uint32_t missing = 0;     ///< frames lost in between
    std::uint32_t by_arrival = 0;  ///< of these: derived from arrival times only, because the counter may have wrapped
    bool duplicate = false;        ///< the same counter again
    bool restarted = false;        ///< the counter value is not a possible successor; `ticks` is one frame then
  };
  enum class Verdict { kAgrees, kDisagrees, kUncertain };

  double ticks_to(const wire::DecodedMessage& reading) const {
    return static_cast<double>(description_->counter->ticks_between(*last_counter_, reading.counter));
  }
  double frame_ticks() const;
  Step step_to(const wire::DecodedMessage& reading) const;
  bool waited(const wire::DecodedMessage& reading, double elapsed_s) const;
  void miss(std::uint32_t frames, std::uint32_t by_arrival);

  std::int64_t start(const wire::DecodedMessage& reading);
  std::int64_t measured_ns(const wire::DecodedMessage& reading) const;
  std::optional<std::int64_t> stamp_device(const wire::DecodedMessage& reading, const Step& step, double y);
  std::int64_t stamp_host(const wire::DecodedMessage& reading, const Step& step, double y);
  bool stays_late(double y, double late_s, double limit_s);
  bool leads(double y) const;
  Verdict compare(const wire::DecodedMessage& reading, double y);
  LowerHull::StraightLine line() const;
  bool out_of_step(double residual_s, double y, std::uint32_t behind);
  bool recount(double& residual_s);
  void fit(double y, double residual_s);
  std::optional<double> measured(const wire::AxisReading& reading, std::size_t axis, double& nominal_s);

  wire::FrameDescriptionPtr description_;
  ClockSettings settings_;
  ClockStatus status_;
  double tick_s_ = 0;                  ///< nominal
  double near_ticks_ = 0;              ///< a longer step of the counter is a jump
  std::int64_t milliticks_per_s_ = 0;  ///< of the device clock; 0: not an integer
  double byte_time_ns_ = 0;

  bool running_ = false;
  std::int64_t last_arrival_ns_ = 0;  ///< of any message type
  std::optional<std::uint64_t> last_counter_;
  std::optional<wire::DecodedMessage> held_;
  std::int64_t begin_ns_ = 0;      ///< of the session: its first reading
  std::int64_t last_time_ns_ = 0;  ///< of the last stamp; goes back only with a session, or if a clock was set
  bool began_session_ = false;
  bool counted_ = false;  ///< the last reading is counted in ClockStatus::samples

  std::int64_t origin_ns_ = 0;  ///< host time where x and y are 0
  double ticks_ = 0;            ///< unwrapped, since origin
  double x_ = 0;                ///< the same in nominal seconds
  double gyro_x_ = 0;           ///< of the last frame with gyro data
  double late_since_y_ = -1;    ///< since when every arrival is over the limit; negative: the last was not
  double least_late_s_ = 0;     ///< minimum delay in this time
  double slope_ = 1;            ///< estimated host seconds per nominal device second
  struct Fit {
    LowerHull active, next;
    double next_since_x = 0;
    double jitter_s = 1e-3;  ///< largest delay of arrivals above the line; at least 1 ms is assumed
    std::uint64_t points = 1;
  } fit_;  ///< host
  struct Pace {
    TimePoint anchor, next_anchor, last;  ///< of frames that agree; the first two begin the windows
    std::optional<TimePoint> after_gap;   ///< first frame after a long gap, while the time is uncertain
    double rate = 0;                      ///< device seconds per second of the window before; 0: not known yet
  } pace_;                                ///< device

  struct AxisState {
    std::uint32_t missing = 0;    ///< frames lost since its last sample
    double x = 0;                 ///< of the last reading with this axis; accumulated: of the last angle
    std::optional<double> angle;  ///< accumulated: the last one
    double usual_s = 0;           ///< shortest interval between two readings with this axis
    double longest_s = 0;         ///< accumulated: no difference over a longer interval, except the usual one
  };
  std::vector<AxisState> axes_;  ///< as FrameDescription::axes
  FrameRateCheck rate_check_;
};

}  // namespace prism::drivers
