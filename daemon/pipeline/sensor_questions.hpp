// SPDX-License-Identifier: MIT
// Changes of a sensor that may be a fault or true: prismd cannot decide, and asks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "compensation/compensated.hpp"
#include "compensation/jump_watch.hpp"
#include "daemon/pipeline/axis_sensors.hpp"
#include "daemon/pipeline/notice.hpp"

namespace prism::pipeline {

/// Two questions for each sensor of an axis:
/// - It jumped faster than its greatest slope, and stayed. Ends when it jumps back, when another sensor of the same
/// unit
///   changes by at least half as much within kAgreeS, or when it is acknowledged.
/// - It was constant for a time (kStillS, for the rate kStillRateS) and ten times longer than ever before. Ends when it
///   changes, or when it is acknowledged. A coarse thermometer in its first soak causes one, too.
class SensorQuestions {
 public:
  static constexpr int kAgreeS = 600, kStillS = 1800, kStillRateS = 60;
  static constexpr int kChanges = 30;  ///< changes of the one-second mean before a constant value can be a question

  /// Rows must be passed in order of creation. Returns a notice for each question that begins or ends.
  std::vector<Notice> push(const compensation::CompensatedWindow& row);

  /// One line each.
  std::vector<std::string> open() const;
  /// Ends all open questions; returns their texts.
  std::vector<std::string> acknowledge();

 private:
  struct Jump {
    compensation::JumpWatch::Jump values;
    std::int64_t second = 0;
    std::string question;                ///< empty: not open
    double mean_before = kUnknown;       ///< the last second's before the jump
    std::vector<double> sensors_before;  ///< the other sensors then
  };
  struct Stillness {
    double value = kUnknown;
    int seconds = 0, longest_s = 0, changes = 0;
    std::string question;
  };

  void watch_jump(std::size_t i, const compensation::CompensatedWindow& row, std::vector<Notice>& notices);
  void ask_about_jump(std::size_t i, const compensation::JumpWatch::Jump& values, std::int64_t second,
                      std::vector<Notice>& notices);
  void seek_agreement(std::size_t i, const compensation::SecondMean& now, std::vector<Notice>& notices);
  static void watch_stillness(Stillness& still, double value, const char* name, const char* unit, int least_s,
                              std::vector<Notice>& notices);

  std::array<compensation::JumpWatch, kAxisSensors.size()> watch_;
  std::array<Jump, kAxisSensors.size()> latest_, open_;
  std::array<double, kAxisSensors.size()> last_{kUnknown, kUnknown, kUnknown};  ///< plausible means
  std::vector<double> last_sensors_;
  std::vector<Stillness> still_;  ///< kAxisSensors, then the sensors of the list
};

}  // namespace prism::pipeline
