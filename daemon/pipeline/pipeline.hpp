// SPDX-License-Identifier: MIT
// Bytes → readings → samples → rows: the one path that live, replay, training from captures and judging run.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/engine.hpp"
#include "daemon/pipeline/sensor_feed.hpp"
#include "daemon/pipeline/setup.hpp"
#include "drivers/clock.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"

namespace prism::pipeline {

/// What a call made, in the order in which it came to be. Rows of one frame stand together: the seconds that it closes
/// before its samples.
struct Rows {
  struct Window {
    std::size_t axis;            ///< index into Pipeline::axes()
    std::size_t samples_before;  ///< how many of `samples` came before it
    std::int64_t session_ns;     ///< of the session it belongs to: the arrival time at which that began
    compensation::CompensatedWindow row;
  };
  struct Sample {
    std::size_t axis = 0;
    compensation::Compensated row;
  };
  std::vector<Sample> samples;
  std::vector<Window> windows;
  /// Their names; outlives the pipeline that made the rows.
  std::shared_ptr<const std::vector<std::string>> axes;

  void clear() { samples.clear(), windows.clear(); }
};

/// One input axis of the device: its corrections do not depend on the others'.
struct Axis {
  std::string name;  ///< as the frame description calls it
  compensation::Engine engine;
  std::int64_t last_ns = 0;  ///< arrival of its last frame
  int thermometer = -1;      ///< index into Setup::sensors; -1: what the frame description says
};

/// Synchronous and deterministic: what comes out depends on the bytes, their arrival times and the set-up only. Each
/// call returns its rows; they stand until the next call.
///
/// Within a session seconds only go forward. One begins where the line was opened, with the first bytes where nobody
/// said so, and with the frame whose second is before the last one's (a clock was set and nobody noticed).
class Pipeline {
 public:
  explicit Pipeline(const Setup& setup);

  /// The line was opened (again) at now_ns: the second in progress is closed, and nothing held from before continues.
  const Rows& begin_session(std::int64_t now_ns);
  /// Of all lines the arrival times never decrease, but for a host clock that was set: sessions begin on all of them.
  const Rows& feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);
  /// Nothing has arrived until now_ns: a candidate that waits for its end may be given up.
  const Rows& expire(std::int64_t now_ns);
  /// The end of the run: what can still be read is read, the open second is closed.
  const Rows& finish();

  /// The same for a sensor line (index into Setup::sensor_lines): makes no row. What arrives at the same time as the
  /// gyro's bytes is given first.
  void begin_sensor_session(std::size_t line, std::int64_t now_ns) { feeds_[line].begin_session(now_ns); }
  void feed_sensors(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);

  /// Takes the models of `setup`. A refusal leaves everything as it was.
  Result<void> use_models(const Setup& setup);

  const wire::FrameDecoder& decoder() const { return decoder_; }
  const drivers::Clock& clock() const { return clock_; }
  const std::vector<Axis>& axes() const { return axes_; }
  const std::vector<SensorFeed>& sensor_feeds() const { return feeds_; }
  /// Of all sensors, as Setup::sensors; kUnknown: not known at that time.
  std::vector<double> sensors_now(std::int64_t now_ns) const;

 private:
  const Rows& pass();
  void begin_axes(std::int64_t now_ns);
  void end_axes();
  void close_second(std::size_t axis, std::size_t samples_before, const compensation::CompensatedWindow& row);
  void enter_second(const Sample& sample, std::int64_t arrival_ns);
  std::span<const double> sensors_at(const wire::Reading& reading);

  wire::FrameDecoder decoder_;
  drivers::Clock clock_;
  std::vector<Axis> axes_;
  std::vector<SensorFeed> feeds_;
  std::vector<wire::Reading> readings_;
  std::vector<double> values_;              ///< of all sensors: the device's, then the lines'
  std::uint32_t stride_ = 1, waiting_ = 0;  ///< without sensors of its own: every so many readings take the lines'
  std::int64_t last_arrival_ns_ = 0;
  std::optional<std::int64_t> session_ns_, last_second_;
  Rows rows_;
};

}  // namespace prism::pipeline
