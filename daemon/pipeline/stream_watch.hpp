// SPDX-License-Identifier: MIT
// Faults that the stream of a device shows: stages without output, clocks that differ, sensors that jump or stand
// still.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/problems.hpp"
#include "compensation/compensated.hpp"
#include "compensation/plausibility.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "drivers/clock.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::pipeline {

/// Finds a stage of the pipeline that has input and no output (bytes → frames → samples → rates).
class StageMonitor {
 public:
  static constexpr double kStarvedS = 10;

  /// Returns the problem ("100 frames and no number for axis z, for example \"1,25\"") while a stage has had at least
  /// 10 inputs and no output for kStarvedS; empty: none. Call at least once a second while data arrive; now_ns: arrival
  /// time.
  std::string push(const Pipeline& pipeline, std::int64_t now_ns);
  /// A new session: the time before it does not count.
  void begin() { stages_.clear(); }

 private:
  /// Totals since the pipeline was created.
  struct Counts {
    std::vector<std::uint64_t> stages;  ///< bytes, frames, samples of any axis, and known rates of each axis
    std::uint64_t refused = 0;          ///< frames that a refuse rule rejects
    std::uint64_t single = 0;           ///< frames that no second one confirmed
    std::uint64_t repeated = 0;         ///< frames with the counter or time tag of the frame before
  };
  struct Stage {
    std::int64_t since_ns = 0;  ///< when its output last grew
    Counts before;              ///< the counts at that time
  };
  static Counts counts_of(const Pipeline& pipeline);

  std::vector<Stage> stages_;  ///< frames, samples, and the rates of each axis
};

/// How described and arrival times disagree, in one line; empty if they do not.
std::string clocks_text(const wire::FrameDescription& frames, const drivers::FrameRateCheck& check);
/// A gyro with time tags that sends another number of frames than described, in one line; else empty. Its times are
/// right.
std::string tagged_rate_text(const wire::FrameDescription& frames, const drivers::FrameRateCheck& check);

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

/// Two changes of each sensor of an axis:
/// - It jumped faster than its greatest slope, and stayed. Ends when it jumps back, or when another sensor of the same
///   unit changes by at least half as much within kAgreeS.
/// - It was constant for a time (kStillS, for the rate kStillRateS) and ten times longer than ever before. Ends when it
///   changes. A coarse thermometer in its first soak causes one, too.
class SensorChanges {
 public:
  static constexpr int kAgreeS = 600, kStillS = 1800, kStillRateS = 60;
  static constexpr int kChanges = 30;  ///< changes of the one-second mean before a constant value is one

  /// The axis, and where its changes are problems, whose texts begin with `prefix`.
  struct Place {
    const std::string &axis, &prefix;
    Problems& problems;
  };
  /// Rows must be passed in order of creation.
  void push(const compensation::CompensatedWindow& row, Place place);
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
