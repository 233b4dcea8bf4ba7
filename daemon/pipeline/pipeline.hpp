// SPDX-License-Identifier: MIT
// Bytes → decoded messages → samples → rows. Used live, in replays, in training from captures and in evaluation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/compensation_engine.hpp"
#include "daemon/pipeline/setup.hpp"
#include "drivers/clock.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"

namespace prism::pipeline {

/// A value is valid from the arrival of its last byte until the next value, at most stale_after_s. The value at a time
/// depends only on the bytes and their arrival times, not on the time of the query.
class SensorFeed {
 public:
  explicit SensorFeed(const Setup::SensorLine& line);

  /// The line was opened (again) at now_ns. Earlier values stay valid unless the host clock was set back.
  void begin_session(std::int64_t now_ns);
  /// `needed_since_ns`: earliest time of later queries; `latest_ns`: latest time of queries for data so far. Values in
  /// between are stored, and at most one after.
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns, std::int64_t needed_since_ns,
            std::int64_t latest_ns);

  /// Writes the value of each sensor that was valid at `at_ns`; kUnknown if no value was valid.
  void values_at(std::int64_t at_ns, std::span<double> values) const;
  /// Arrival of the last value of any sensor.
  std::optional<std::int64_t> last_ns() const;

  std::size_t sensors() const { return decoder_.description().sensors().size(); }
  const wire::FrameDecoder& decoder() const { return decoder_; }

 private:
  struct Values {
    std::int64_t arrival_ns;
    std::vector<double> values;
  };
  void forget(std::int64_t needed_since_ns, std::int64_t latest_ns);

  wire::FrameDecoder decoder_;
  std::int64_t stale_ns_;
  std::deque<Values> values_;  ///< oldest first
  std::vector<wire::DecodedMessage> readings_;
};

/// Rows of one call, in order of creation. For each frame: the seconds that it closes, then its samples.
struct Rows {
  struct Window {
    std::size_t axis;            ///< index into Pipeline::axes()
    std::size_t samples_before;  ///< number of entries of `samples` that precede it
    std::int64_t session_ns;     ///< arrival time at which its session began
    compensation::CompensatedWindow row;
  };
  struct Sample {
    std::size_t axis = 0;
    compensation::Compensated row;
  };
  /// A frame with gyro data that was decoded in this call, and its samples; none if the counter check holds it back or
  /// the clock refuses it.
  struct Frame {
    wire::DecodedMessage message;
    std::size_t first_sample = 0, sample_count = 0;
  };
  std::vector<Sample> samples;
  std::vector<Window> windows;
  std::vector<Frame> frames;  ///< only if the set-up has outputs
  /// Names of the axes; valid after the pipeline was destroyed.
  std::shared_ptr<const std::vector<std::string>> axes;

  void clear() { samples.clear(), windows.clear(), frames.clear(); }
};

/// One input axis of the device; axes are corrected independently.
struct Axis {
  std::string name;  ///< as in the frame description
  compensation::CompensationEngine engine;
  std::int64_t last_ns = 0;  ///< arrival of its last frame
  std::uint64_t rates = 0;   ///< samples with a known rate
  int thermometer = -1;      ///< index into Setup::sensors; -1: as in the frame description
  int uhfo = -1;             ///< the same of the UHFO voltage
};

/// Synchronous and deterministic: the rows depend only on the bytes, their arrival times and the set-up. The rows that
/// a call returns are valid until the next call.
///
/// Within a session the seconds increase. A session begins with begin_session(), else with the first bytes, with a
/// frame whose second is before the last one (after an undetected clock step), and if the device's time starts again
/// (Clock::began_session()).
class Pipeline {
 public:
  explicit Pipeline(const Setup& setup);

  /// The line was opened (again) at now_ns: closes the current second and discards the decoder's and clock's state.
  Rows& begin_session(std::int64_t now_ns);
  /// Arrival times never decrease over all lines, except when the host clock was set, which begins a session on all
  /// lines.
  Rows& feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);
  /// No data arrived until now_ns: incomplete frame candidates may expire.
  Rows& expire(std::int64_t now_ns);
  /// End of the run: decodes the remaining bytes and closes the current second.
  Rows& finish();

  /// The same for a sensor line (index into Setup::sensor_lines); creates no row. Sensor bytes that arrive with gyro
  /// bytes must be passed first.
  void begin_sensor_session(std::size_t line, std::int64_t now_ns) { feeds_[line].begin_session(now_ns); }
  void feed_sensors(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);

  /// Applies the models of `setup`. On error, the models are unchanged.
  Result<void> use_models(const Setup& setup);

  /// An offset by command of an axis; kUnknown: none.
  void set_offset(std::size_t axis, double deg_per_h) { axes_[axis].engine.set_offset(deg_per_h); }

  const wire::FrameDecoder& decoder() const { return decoder_; }
  const drivers::Clock& clock() const { return clock_; }
  /// Arrival of the last frame with gyro data; 0: none yet.
  std::int64_t last_frame_ns() const;
  const std::vector<Axis>& axes() const { return axes_; }
  const std::vector<SensorFeed>& sensor_feeds() const { return feeds_; }
  /// Values of all sensors, as Setup::sensors; kUnknown: not known at that time.
  std::vector<double> sensors_now(std::int64_t now_ns) const;

 private:
  Rows& pass();
  void handle(const wire::DecodedMessage& reading);
  void begin_axes(std::int64_t now_ns);
  void end_axes();
  void close_second(std::size_t axis, std::size_t samples_before, const compensation::CompensatedWindow& row);
  void enter_second(const Sample& sample, std::int64_t arrival_ns);
  std::span<const double> sensors_at(const wire::DecodedMessage& reading);

  wire::FrameDecoder decoder_;
  drivers::Clock clock_;
  std::vector<Axis> axes_;
  std::vector<SensorFeed> feeds_;
  std::vector<wire::DecodedMessage> readings_;
  std::vector<double> values_;  ///< of all sensors: the device's, then the lines'
  std::uint32_t stride_ = 1,
                waiting_ =
                    0;  ///< for a device without sensors: every stride_-th reading takes the sensor lines' values
  bool keeps_frames_ = false;
  std::int64_t last_arrival_ns_ = 0;
  std::optional<std::int64_t> session_ns_, last_second_;
  Rows rows_;
};

}  // namespace prism::pipeline
