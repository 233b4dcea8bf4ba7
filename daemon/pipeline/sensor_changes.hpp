// SPDX-License-Identifier: MIT
// Changes of a sensor that may be a fault or true.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/problems.hpp"
#include "compensation/compensated.hpp"
#include "compensation/plausibility.hpp"
#include "daemon/pipeline/axis_sensors.hpp"

namespace prism::pipeline {

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
