// SPDX-License-Identifier: MIT
// Sensor values of an instrument on a line of its own, by arrival time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/problems.hpp"
#include "compensation/compensated.hpp"
#include "compensation/plausibility.hpp"
#include "daemon/pipeline/setup.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"

namespace prism::pipeline {

// The measured quantities of an axis, for code that treats them alike.

struct AxisSensor {
  const char *name, *unit;
  bool QuantitySet::*in_set;
  compensation::Rejection compensation::Rejections::*rejection;
  double compensation::SecondMean::*value;
};

inline constexpr std::array kAxisSensors = {
    AxisSensor{"rate", "deg/h", &QuantitySet::rate, &compensation::Rejections::rate,
               &compensation::SecondMean::rate_deg_per_h},
    AxisSensor{"temperature", "degC", &QuantitySet::temperature, &compensation::Rejections::temperature,
               &compensation::SecondMean::temperature_degc},
    AxisSensor{"uhfo", "V", &QuantitySet::uhfo, &compensation::Rejections::uhfo, &compensation::SecondMean::uhfo_v}};

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

  std::size_t sensors() const { return decoder_.description().sensors.size(); }
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

// Changes of a sensor that may be a fault or true.

/// Two changes of each sensor of an axis:
/// - It jumped faster than its greatest slope, and stayed. Ends when it jumps back, or when another sensor of the same
///   unit changes by at least half as much within kAgreeS.
/// - It was constant for a time (kStillS, for the rate kStillRateS) and ten times longer than ever before. Ends when it
///   changes. A coarse thermometer in its first soak causes one, too.
class SensorChanges {
 public:
  static constexpr int kAgreeS = 600, kStillS = 1800, kStillRateS = 60;
  static constexpr int kChanges = 30;  ///< changes of the one-second mean before a constant value is one

  /// Rows must be passed in order of creation. Each change is a problem; `prefix`: of its text.
  void push(const compensation::CompensatedWindow& row, const std::string& prefix, Problems& problems);
  /// Forgets the changes that have not ended.
  void forget();

 private:
  struct Jump {
    compensation::JumpWatch::Jump values;
    std::int64_t second = 0;
    bool open = false;
    double mean_before = kUnknown;       ///< the last second's before the jump
    std::vector<double> sensors_before;  ///< the other sensors then
  };
  struct Stillness {
    double value = kUnknown;
    int seconds = 0, longest_s = 0, changes = 0;
    bool open = false;
  };

  struct Place {
    const std::string& prefix;
    Problems& problems;
  };
  void watch_jump(std::size_t i, const compensation::CompensatedWindow& row, Place place);
  void begin_jump(std::size_t i, const compensation::JumpWatch::Jump& values, std::int64_t second, Place place);
  void seek_agreement(std::size_t i, const compensation::SecondMean& now, Place place);
  static void watch_stillness(Stillness& still, double value, const std::string& name, const std::string& unit,
                              int least_s, Place place);

  std::array<compensation::JumpWatch, kAxisSensors.size()> watch_;
  std::array<Jump, kAxisSensors.size()> latest_, open_;
  std::array<double, kAxisSensors.size()> last_{kUnknown, kUnknown, kUnknown};  ///< plausible means
  std::vector<double> last_sensors_;
  std::vector<Stillness> still_;  ///< kAxisSensors, then the sensors of the list
};

}  // namespace prism::pipeline
