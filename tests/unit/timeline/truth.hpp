// SPDX-License-Identifier: MIT
// A gyro whose true time and rate are known, and the damages of docs/frames.md on the way to the reader.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "compensation/second_averager.hpp"
#include "drivers/clock.hpp"
#include "drivers/counter_check.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::test {

enum class Damage {
  kNone,
  kWrap,          ///< the counter wraps
  kReset,         ///< the counter begins at 0 again, without a pause
  kReboot,        ///< 2.3 s of silence; counter and angle begin at 0 again
  kWrongCounter,  ///< one frame has a counter that is too high
  kCounterShift,  ///< the counter is too high from one frame on
  kShortGap,      ///< 0.4 s of frames are lost
  kLongGap,       ///< 20 s
  kGapOverWrap,   ///< 400 s: the counter wraps unseen
  kSuspended,     ///< 30 h: the angle wraps unseen, too
  kClockForward,  ///< the host clock is set forward by an hour, unnoticed
  kClockBack,     ///< back by an hour
  kBatches,       ///< frames arrive in batches of 16
  kDuplicate,     ///< a frame comes twice
  kSwap,          ///< two frames change places
  kSeveralTypes   ///< frames without gyro data in between
};
inline constexpr int kDamages = static_cast<int>(Damage::kSeveralTypes) + 1;

enum class TimeSource { kHost, kDevice, kRawBytes };

inline constexpr double kRate_hz = 200, kBegin_s = 1.0e9;

/// True rate, deg/h: it changes, so that a mean over another time is another value.
inline double true_rate(double t_s) { return 17'000 + 0.5 * t_s; }
/// Its integral since t = 0, arcsec.
inline double true_angle(double t_s) { return 17'000 * t_s + 0.25 * t_s * t_s; }

struct TrueFrame {
  wire::DecodedMessage reading;
  double t_s = 0;  ///< end of its interval, device time
};

/// trplg (16-bit counter at 200 Hz); `meaning`: "rate", "increment" or "accumulated" (32 bits of 0.1 arcsec).
inline wire::FrameDescriptionPtr timeline_description(const std::string& meaning, double rate_hz = kRate_hz) {
  std::string text = read_file(frames_dir() / (meaning == "increment" ? "trplg-increment.json" : "trplg.json"));
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("\"rate_hz\": 200", "\"rate_hz\": " + std::to_string(rate_hz));
  if (meaning == "rate") {
    replace(R"("type": "u32", "unit": "pulse")", R"("type": "u32", "unit": "deg/h")");
    replace(R"("meaning": "accumulated", "unit": "pulse", "arcsec_per_pulse": 0.1,)",
            R"("meaning": "rate", "unit": "deg/h",)");
  }
  return description_of(text);
}

/// Frames of `length_s` with `damage` in the middle. `first_counter`: of the first frame.
inline std::vector<TrueFrame> true_frames(const wire::FrameDescription& description, TimeSource source, Damage damage,
                                          double length_s, std::uint64_t first_counter) {
  const bool accumulated = description.gyro.meaning == wire::RateEncoding::kAccumulated;
  const bool is_rate = description.gyro.meaning == wire::RateEncoding::kRate;
  const double scale = description.axes[0].scale, middle_s = length_s / 2;
  const double lost_s = damage == Damage::kReboot        ? 2.3
                        : damage == Damage::kShortGap    ? 0.4
                        : damage == Damage::kLongGap     ? 20
                        : damage == Damage::kGapOverWrap ? 400
                        : damage == Damage::kSuspended   ? 108'000
                                                         : 0;
  std::vector<TrueFrame> frames;
  double angle_zero = 0;
  std::uint64_t counter_zero = 0;
  double host_offset_s = 0;
  bool happened = false;
  std::uint64_t bytes = 0;
  const auto count = static_cast<std::int64_t>((length_s + lost_s) * kRate_hz);
  for (std::int64_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i + 1) / kRate_hz;
    if (t > middle_s && t <= middle_s + lost_s) continue;
    if (!happened && t > middle_s + lost_s) {
      happened = true;
      if (damage == Damage::kReset || damage == Damage::kReboot)
        counter_zero = static_cast<std::uint64_t>(i) + first_counter;
      if (damage == Damage::kReboot) angle_zero = true_angle(t);
      if (damage == Damage::kCounterShift) counter_zero = static_cast<std::uint64_t>(-34'000);
      if (damage == Damage::kClockForward) host_offset_s = 3600;
      if (damage == Damage::kClockBack) host_offset_s = -3600;
    }
    TrueFrame frame;
    frame.t_s = t;
    wire::DecodedMessage& r = frame.reading;
    r.length = description.max_frame_bytes;
    r.offset = bytes;
    bytes += r.length;
    r.has_gyro = r.has_counter = r.gyro[0].carried = r.gyro[0].valid = true;
    std::uint64_t counter = first_counter + static_cast<std::uint64_t>(i) - counter_zero;
    if (damage == Damage::kWrongCounter && i == static_cast<std::int64_t>(middle_s * kRate_hz)) counter += 34'000;
    r.counter = counter % 65536;
    const double pulses = std::floor((true_angle(t) - angle_zero) / scale);
    r.gyro[0].value = is_rate ? true_rate(t - 0.5 / kRate_hz) / scale
                      : accumulated
                          ? std::fmod(pulses, 4294967296.0)
                          : std::floor(true_angle(t) / scale) - std::floor(true_angle(t - 1 / kRate_hz) / scale);
    const double arrived = damage == Damage::kBatches ? std::ceil(static_cast<double>(i + 1) / 16) * 16 / kRate_hz : t;
    const double wire_s = 1e-9 * description.wire.byte_time_ns() * r.length;
    r.behind = damage == Damage::kBatches ? static_cast<std::uint32_t>((15 - i % 16) * r.length) : 0;
    const double backlog_s = 1e-9 * description.wire.byte_time_ns() * r.behind;
    // raw bytes have a pace of their own: twice too slow, as in a stream of several lengths
    const double host_s = source == TimeSource::kRawBytes ? 2 * static_cast<double>(r.offset) / (r.length * kRate_hz)
                                                          : kBegin_s + arrived + host_offset_s;
    r.arrival_ns = std::llround(1e9 * (host_s + wire_s - (source == TimeSource::kRawBytes ? 0 : backlog_s)));
    r.temperature_degc = 25;
    if (damage == Damage::kSeveralTypes && i % 3 == 0) {
      TrueFrame other = frame;
      other.reading.has_gyro = other.reading.has_counter = false;
      frames.push_back(other);
    }
    frames.push_back(frame);
    if (damage == Damage::kDuplicate && happened && i == static_cast<std::int64_t>(middle_s * kRate_hz) + 5)
      frames.push_back(frame);
    const std::size_t n = frames.size();
    if (damage == Damage::kSwap && i == static_cast<std::int64_t>(middle_s * kRate_hz) + 5)
      std::swap(frames[n - 1], frames[n - 2]);
  }
  return frames;
}

struct TimedSample {
  Sample sample;
  int session = 0;
  double t_s = 0;  ///< true
};

/// Counter check and clock, as in the pipeline.
class Timeline {
 public:
  Timeline(const wire::FrameDescriptionPtr& description, TimeSource source)
      : check_(description),
        clock_(description,
               {.source = source == TimeSource::kHost ? drivers::ClockSource::kHost : drivers::ClockSource::kDevice,
                .arrivals_are_measured = source != TimeSource::kRawBytes}) {}

  std::vector<TimedSample> run(const std::vector<TrueFrame>& frames) {
    std::vector<TimedSample> samples;
    int session = 0;
    std::vector<TrueFrame> recent;
    for (const TrueFrame& frame : frames) {
      recent.push_back(frame);
      for (const wire::DecodedMessage& reading : check_.push(frame.reading)) {
        const bool measured = clock_.push(reading);
        session += clock_.began_session();
        if (!measured) continue;
        const auto sample = clock_.sample(reading, 0);
        if (!sample) continue;
        const auto truth = std::find_if(recent.rbegin(), recent.rend(),
                                        [&](const TrueFrame& f) { return f.reading.offset == reading.offset; });
        samples.push_back({*sample, session, truth->t_s});
      }
    }
    return samples;
  }
  const drivers::ClockStatus& status() const { return clock_.status(); }
  std::uint64_t rejected() const { return check_.rejected(); }

 private:
  drivers::CounterCheck check_;
  drivers::Clock clock_;
};

}  // namespace prism::test
