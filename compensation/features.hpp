// SPDX-License-Identifier: MIT
// The inputs of a model: the definition of its features, and one set of them. Stored in the model file, not in the
// configuration of the daemon.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "compensation/second_averager.hpp"
#include "compensation/sensors.hpp"

namespace prism::compensation {

enum class SlopeMethod {
  kDifference,    ///< (T now − T length_s before) / length_s, each end a mean of end_mean_s: the paper's
  kLeastSquares,  ///< slope of the line through all one-second means of the window
};

/// How one-second means become features. Live, replay and training use the same definition.
struct FeatureDefinition {
  int length_s = 100;  ///< window of the means and of the slope, 1 to 3600 s
  SlopeMethod slope = SlopeMethod::kDifference;
  int end_mean_s = 10;  ///< kDifference: length of the mean at each end, 1 s to length_s
  int max_gap_s = 5;    ///< a longer gap empties the window, 0 to 3600 s
  /// Time constant, s, up to 1e6, with which the gyro's body follows T that is not in it: each one-second mean passes a
  /// first-order response first, so that all features are those of the body. 0: unchanged.
  int response_s = 0;
  /// Sensors that inputs use, with their units.
  std::vector<SensorName> sensors;

  bool operator==(const FeatureDefinition&) const = default;
};

/// Seconds of data in a full window.
int history_s(const FeatureDefinition& definition);

enum class WindowState {
  kWarming,  ///< not enough history since the start or the last gap, or rate, temperature or slope unknown
  kReady,    ///< a full window with rate, temperature and slope
};

/// The features of one sensor.
struct SensorWindow {
  double mean = kUnknown;
  double slope_per_s = kUnknown;
};

/// The features at the end of one second. Means are over the last length_s seconds (fewer while warming).
struct Window {
  SecondMean second_mean;  ///< the second that completed this window
  WindowState state = WindowState::kWarming;
  int warm_s = 0;  ///< seconds of history, up to history_s()
  int gap_s = 0;   ///< seconds without samples just before this second
  double rate_deg_per_h = kUnknown;
  double temperature_degc = kUnknown;
  double slope_degc_per_s = kUnknown;
  double uhfo_v = kUnknown;
  std::vector<SensorWindow> sensors;  ///< as FeatureDefinition::sensors
  bool settling = false;              ///< less than three of its time constants since a response started
};

/// The names of model inputs in files and on command lines: "T", "dTdt", "U"; of a sensor named case its mean "case"
/// and its slope "dcase/dt"; and the difference of two means, "case-T".
inline constexpr const char* kInputTemperature = "T";
inline constexpr const char* kInputSlope = "dTdt";
inline constexpr const char* kInputUhfo = "U";

/// "dTdt" or "dNAME/dt".
bool is_slope(const std::string& input);

/// The sensors of these inputs, in order, without duplicates; ignores names that are not inputs.
std::vector<std::string> sensors_of(const std::vector<std::string>& inputs);

/// Returns true if windows of this definition contain the input `name`.
bool has_input(const FeatureDefinition& definition, const std::string& name);

/// The unit of an input of the definition: degC, degC/s, V, …
std::string unit_of_input(const FeatureDefinition& definition, const std::string& name);

/// The value of one input in a window; kUnknown if the window does not contain it. Requires has_input(name).
double input_value(const Window& window, const FeatureDefinition& definition, const std::string& name);

// The only conversion of seconds to features: takes one-second means, returns one window for each.

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
/// A response takes the body as steady at the first temperature, and for three of its time constants the window is
/// `settling`, but used. No accumulated rounding: only the response is recursive. It restarts if its last known
/// temperature is more than max(max_gap_s + 1, time constant / 10) s old, or after a step back in time.
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
  void respond(SecondMean& second_mean, Window& window);
  void measure(Window& window) const;
  double quantity(const SecondMean& second_mean, std::size_t sensor) const;
  void use_sensor_list(const SecondMean& second_mean);

  FeatureDefinition definition_;
  std::deque<SecondMean> history_;
  std::int64_t warm_since_ = 0;      ///< second of the first mean since the window was emptied
  std::int64_t incomplete_;          ///< last second after a gap, without a rate or without a temperature
  SensorList known_list_;            ///< of the last mean
  std::vector<std::size_t> places_;  ///< index in that list of each sensor of the definition; its size if absent
  double body_degc_ = kUnknown;      ///< after the response
  std::int64_t body_since_ = 0, body_last_ = 0;  ///< seconds: its start, and of its last temperature
};

}  // namespace prism::compensation
