// SPDX-License-Identifier: MIT
// The only conversion of seconds to features: takes one-second means, returns one window for each.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "compensation/features.hpp"

namespace prism::compensation {

/// Live, replay and training use this class for all their data; a second implementation would add bias.
///
/// Means are over the last length_s seconds, slopes over the last history_s(). A window is full (warm_s == history_s())
/// when it spans history_s() seconds, gaps of up to max_gap_s included. It is ready when it is full and its mean rate,
/// mean temperature and temperature slope are known.
///
/// A temperature that was unknown for longer than max_gap_s within length_s has no mean, so that old values of a failed
/// sensor are not used, and the window is not ready. Its slope is unknown if the seconds that it uses (kDifference: the
/// two ends) have such a gap, or an end has no value. The UHFO voltage and the sensors follow the same rules, but do
/// not affect "ready": devices without UHFO have ready windows with mean UHFO kUnknown. The mean rate is over the known
/// rates, whatever their gaps. Implausible values count as unknown. Shorter gaps have no effect: means use the
/// available seconds, slopes their true times. Cost: O(history_s) per second.
///
/// No accumulated rounding: only the lag filters are recursive. They restart if the last known temperature is more than
/// max(max_gap_s + 1, shortest time constant / 10) s old, or after a step back in time.
class FeatureExtractor {
 public:
  explicit FeatureExtractor(FeatureDefinition definition);

  /// Takes means in order of time, but not partial ones. One that is not later than the one before empties the window,
  /// as a gap does: the clock was set back. So does a sensor list with the definition's sensors at other positions.
  Window push(const SecondMean& second_mean);

  /// Like push(), for a caller that needs no ready window: returns none if it is ready, in O(1) while no rate or
  /// temperature is missing.
  std::optional<Window> push_unless_ready(const SecondMean& second_mean);

  /// Clears all state except the sensor list, for a new session of the device.
  void reset();

  const FeatureDefinition& definition() const { return definition_; }

 private:
  Window take(const SecondMean& second_mean);
  void admit(const SecondMean& second_mean, Window& window);
  void measure(Window& window) const;
  void update_lags(const SecondMean& second_mean, Window& window);
  double quantity(const SecondMean& second_mean, std::size_t sensor) const;
  void use_sensor_list(const SecondMean& second_mean);

  FeatureDefinition definition_;
  std::deque<SecondMean> history_;
  std::int64_t warm_since_ = 0;      ///< second of the first mean since the window was emptied
  std::int64_t incomplete_;          ///< last second after a gap, without a rate or without a temperature
  SensorList known_list_;            ///< of the last mean
  std::vector<std::size_t> places_;  ///< index in that list of each sensor of the definition; its size if absent
  std::vector<double> lag_mean_degc_;
  std::vector<std::vector<double>> sensor_lag_mean_;  ///< by sensor; kUnknown before the first known value
  std::int64_t last_lag_second_ = 0;
  std::int64_t lag_age_s_ = -1;
};

}  // namespace prism::compensation
