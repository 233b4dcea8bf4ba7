// SPDX-License-Identifier: MIT
// Assigns times to readings: unwraps the counter, counts missing frames, removes arrival jitter. Never waits.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "compensation/sample.hpp"
#include "drivers/counter_unwrapper.hpp"
#include "drivers/lower_hull.hpp"
#include "drivers/wire/decode/decoded_message.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::drivers {

enum class ClockSource {
  kHost,    ///< arrival times of this machine, de-jittered by the device's counter
  kDevice,  ///< first arrival + counter x nominal period: fast replays, and devices with an accurate clock
};

struct ClockSettings {
  ClockSource source = ClockSource::kHost;
  double switch_s = 100;            ///< host: the two windows of the fit alternate after this many seconds; 10 to 3600
  double residual_limit_s = 0.020;  ///< host: a stamp with a larger error restarts the fit; > 0
};

struct ClockStatus {
  std::uint64_t samples = 0;
  std::uint64_t missing_frames = 0;
  std::uint64_t missing_by_arrival = 0;  ///< of these: derived from arrival times, because the counter may have wrapped
  std::uint64_t duplicates = 0;          ///< frames with the counter of the frame before: no sample
  std::uint64_t resets = 0;          ///< restarts of the fit: counter reset or residual over the limit (not reset())
  double period_s = 0;               ///< the frame period in use: estimated (host) or nominal
  bool period_is_estimated = false;  ///< false: still the nominal one
  double residual_s = 0;             ///< host: delay of the last frame relative to the fitted line
};

/// Takes one reading and returns at most one sample per axis. The time of a sample is the end of the interval over
/// which its rate is the mean.
///
/// Host: the counter gives the device's time x, the arrival (minus wire time and latency) the host's time y. The line
/// below all points (lower_hull.hpp) converts x to stamps and gives the true period. The nominal rate is used until
/// the window is long enough to estimate the rate better than the nominal rate's tolerance. Two windows alternate, so
/// that the line always uses the last one to two times switch_s. A reading that is earlier than the line by more than
/// the limit, or later than it for a second, shows that the counter or a clock was set: the fit restarts. If all
/// readings are late by full periods of the counter (by frames, without a counter), frames were lost while the line was
/// not read: they are counted as missing by arrival, and the fit continues.
///
/// Device: first arrival + counter x nominal tick. If the counter jumps back by less than half its modulus, it was
/// restarted; time advances by one frame. Depends only on the first arrival and the counters.
///
/// Without a counter (in this stream) each frame is one period after the previous one; frames lost on the line are
/// derived from the bytes skipped there (if the stream has one message type).
///
/// The first reading of an axis's accumulated angle gives no sample, because it has no predecessor.
class Clock {
 public:
  Clock(wire::FrameDescriptionPtr description, ClockSettings settings = {});

  /// Computes the time of the reading. Returns false if it is a repeated frame or has no rate.
  bool push(const wire::DecodedMessage& reading);
  /// The sample of an axis (index into FrameDescription::axes) of the reading last accepted by push(). Call once for
  /// each.
  std::optional<Sample> sample(const wire::DecodedMessage& reading, std::size_t axis);

  /// The line was reopened: a new session. Stamps may start at any time.
  void reset();

  const ClockStatus& status() const { return status_; }

 private:
  void start(const wire::DecodedMessage& reading);
  void forget_angles();
  void miss(const CounterStep& step);
  std::int64_t stamp_device(const CounterStep& step);
  std::int64_t stamp_host(const wire::DecodedMessage& reading, const CounterStep& step);
  bool out_of_step(double residual_s, double y, std::uint32_t behind);
  bool recount(double& residual_s);
  void fit(double y, double residual_s);
  std::optional<double> turned(const wire::AxisReading& reading, std::size_t axis, double& nominal_s);
  std::int64_t left_device_ns(const wire::DecodedMessage& reading) const;

  wire::FrameDescriptionPtr description_;
  ClockSettings settings_;
  CounterUnwrapper steps_;
  ClockStatus status_;
  double tick_s_ = 0;  ///< nominal
  double byte_time_ns_ = 0;

  bool running_ = false;
  std::int64_t origin_ns_ = 0;     ///< host time where x and y are 0
  double ticks_ = 0;               ///< unwrapped, since origin
  double x_ = 0;                   ///< the same in nominal seconds
  std::int64_t last_time_ns_ = 0;  ///< of the last sample or stamp: stamps never go below

  LowerHull active_, next_;
  double next_since_x_ = 0;
  double jitter_s_ = 0;  ///< largest delay of arrivals above the line
  std::uint64_t points_ = 0;
  double late_since_y_ = -1;  ///< since when every arrival is over the limit; negative: the last was not
  double least_late_s_ = 0;   ///< minimum delay in this time
  double slope_ = 1;          ///< estimated host seconds per nominal device second

  /// State of an axis.
  struct Turn {
    std::uint32_t missing = 0;  ///< frames lost since its last sample
    double x = 0;               ///< of the last reading with this axis
    bool has_angle = false;     ///< accumulated: a previous angle is known
    double angle = 0;
    double angle_x = 0;
  };
  std::vector<Turn> turns_;  ///< as FrameDescription::axes
  bool counted_ = false;     ///< the last reading is counted in ClockStatus::samples
};

}  // namespace prism::drivers
