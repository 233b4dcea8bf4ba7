// SPDX-License-Identifier: MIT
// Gives readings their place in time: counter unwrapped, missing frames known, stamps one can trust. Never waits.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "compensation/sample.hpp"
#include "drivers/arrival_hull.hpp"
#include "drivers/frame_steps.hpp"
#include "drivers/wire/decode/reading.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::drivers {

enum class ClockSource {
  kHost,    ///< arrival times of this machine, de-jittered by the device's counter
  kDevice,  ///< first arrival + counter x nominal period: fast replays, and devices with a trustworthy clock
};

struct ClockSettings {
  ClockSource source = ClockSource::kHost;
  double switch_s = 100;            ///< host: the two windows of the fit take turns after this many seconds; 10 to 3600
  double residual_limit_s = 0.020;  ///< host: a stamp that is off by more begins a new fit; > 0
};

struct ClockStatus {
  std::uint64_t samples = 0;
  std::uint64_t missing_frames = 0;
  std::uint64_t missing_by_arrival = 0;  ///< of these: told by the arrival times, where the counter may have wrapped
  std::uint64_t duplicates = 0;          ///< frames with the counter of the frame before: no sample
  std::uint64_t resets = 0;              ///< fits begun anew: counter reset or residual over the limit (not reset())
  double period_s = 0;                   ///< the frame period in use: estimated (host) or nominal
  bool period_is_estimated = false;      ///< false: still the nominal one
  double residual_s = 0;                 ///< host: how late the last frame came, beyond the fitted line
};

/// One Reading in, at most one Sample of each axis out. A Sample's time is the end of the interval its rate is the mean
/// of.
///
/// Host: the counter gives the device's time x, the arrival (less wire time and latency) the host's time y; the line
/// under all points (arrival_hull.hpp) turns x into stamps and gives the true period. Until the window is long enough
/// to tell more than the nominal rate and its tolerance do, the nominal rate is used. Two windows take turns, so that
/// the line always rests on the last one to two times switch_s. A reading that comes before the line by more than the
/// limit, or later than it for a whole second, shows that the counter or a clock was set: a new fit begins there. Where
/// they all are late by whole turns of the counter (by frames, without a counter), those were lost while nobody read
/// the line: they are counted as missing by arrival, and the fit goes on.
///
/// Device: first arrival + counter x nominal tick. A counter that jumps back by less than half its modulus was
/// restarted; time goes on by one frame. Nothing but the first arrival and the counters enters.
///
/// Without a counter (in this stream) each frame is one period after the one before; frames lost on the line are known
/// from the bytes that were skipped there (where the stream has one kind of frame).
///
/// The first reading of an axis's accumulated angle gives no sample: there is nothing to take the difference to.
class Clock {
 public:
  Clock(wire::FrameDescriptionPtr description, ClockSettings settings = {});

  /// Places the reading in time. False where there is nothing to measure: a repeated frame, or one without a rate.
  bool push(const wire::Reading& reading);
  /// What the reading that push() took last says of an axis (index into FrameDescription::axes). Once each.
  std::optional<Sample> sample(const wire::Reading& reading, std::size_t axis);

  /// The line was opened again: a new session. Stamps may start anywhere.
  void reset();

  const ClockStatus& status() const { return status_; }

 private:
  void start(const wire::Reading& reading);
  void forget_angles();
  void miss(const FrameStep& step);
  std::int64_t stamp_device(const FrameStep& step);
  std::int64_t stamp_host(const wire::Reading& reading, const FrameStep& step);
  bool out_of_step(double residual_s, double y, std::uint32_t behind);
  bool recount(double& residual_s);
  void fit(double y, double residual_s);
  std::optional<double> turned(const wire::GyroReading& reading, std::size_t axis, double& nominal_s);
  std::int64_t left_device_ns(const wire::Reading& reading) const;

  wire::FrameDescriptionPtr description_;
  ClockSettings settings_;
  FrameSteps steps_;
  ClockStatus status_;
  double tick_s_ = 0;  ///< nominal
  double byte_time_ns_ = 0;

  bool running_ = false;
  std::int64_t origin_ns_ = 0;     ///< host time where x and y are 0
  double ticks_ = 0;               ///< unwrapped, since origin
  double x_ = 0;                   ///< the same in nominal seconds
  std::int64_t last_time_ns_ = 0;  ///< of the last sample or stamp: stamps never go below

  ArrivalHull active_, next_;
  double next_since_x_ = 0;
  double jitter_s_ = 0;  ///< how far arrivals lie above the line
  std::uint64_t points_ = 0;
  double late_since_y_ = -1;  ///< since when every arrival is over the limit; below 0: the last was not
  double least_late_s_ = 0;   ///< and by how much at least
  double slope_ = 1;          ///< host seconds per nominal device second, in use

  /// What an axis has come to.
  struct Turn {
    std::uint32_t missing = 0;  ///< frames lost since its last sample
    double x = 0;               ///< of the last reading that carried it
    bool has_angle = false;     ///< accumulated: the angle to take the difference to
    double angle = 0;
    double angle_x = 0;
  };
  std::vector<Turn> turns_;  ///< as FrameDescription::axes
  bool counted_ = false;     ///< the last reading is among ClockStatus::samples
};

}  // namespace prism::drivers
