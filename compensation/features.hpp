// SPDX-License-Identifier: MIT
// The inputs of a model: the definition of its features, and one set of them. Stored in the model file, not in the
// configuration of the daemon.
#pragma once

#include <cstdint>
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
  /// One input T − EMA(T) per time constant, s, > 0: the thermal history.
  std::vector<double> lag_time_constants_s;
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
  std::vector<double> lag;  ///< value − EMA(value), one per time constant; empty if value or T is unknown in the second
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
  std::vector<double> lag_degc;       ///< T − EMA(T), one per time constant; empty if T is unknown in the second
  std::vector<SensorWindow> sensors;  ///< as FeatureDefinition::sensors
  bool lag_settling = false;          ///< less than three of the longest time constants since the lag filters started
};

/// The names of model inputs in files and on command lines: "T", "dTdt", "U", "lag1", "lag2", …; of a sensor named case
/// its mean "case", its slope "dcase/dt", its lags "lag1:case", …; and the difference of two means, "case-T".
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

}  // namespace prism::compensation
