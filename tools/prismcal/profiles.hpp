// SPDX-License-Identifier: MIT
// Chamber profiles: the limits of a chamber, the domain that a model must serve, profiles to compare, and the search
// for the best one.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/features.hpp"
#include "tools/prismsim/simulation/chamber_profile.hpp"

namespace prism::design {

struct ChamberLimits {
  double low_degc = -40, high_degc = 70;  ///< low <= start <= high, low < high
  double rate_degc_per_min = 1;           ///< > 0, of a ramp
  double start_degc = 25;                 ///< of the profile
};

/// A closed range of one input, in the input's unit (features.hpp).
struct InputRange {
  std::string input;
  double low = 0, high = 0;  ///< low < high
};

/// "T=-40:60, dTdt=-1:1 degC/min": NAME=LOW:HIGH and a unit, which slopes need (degC/min or degC/s). Errors: another
/// unit, a range whose limits are not in order, a T beyond −200 to 300 degC, a name twice.
Result<std::vector<InputRange>> parse_domain(const std::string& text);

/// The set-points of a profile, "time_s,temperature_degc": one row per end of a segment, the chamber goes from one to
/// the next in a straight line.
std::string set_points_csv(const simulation::ChamberProfile& profile);

/// Profiles that a user would run without a plan: the paper's cycle within the limits (its plateaus, the ramps as fast
/// as 1 degC/min or the chamber); of `hours`, one slow ramp to each end, the same at full speed with soaks, and a
/// staircase over the range.
std::vector<simulation::ChamberProfile> usual_profiles(const ChamberLimits& limits, double hours);

/// The value of a profile, to be minimised; pure.
using ProfileCost = std::function<double(const simulation::ChamberProfile&)>;

struct FoundProfile {
  simulation::ChamberProfile profile;
  double cost = 0;
};

/// Visits of temperatures, each a ramp and a soak: one to four of them, up to eight segments, `hours` in all. Tries a
/// family (start cold or hot, number of visits, speed, share of the soaks), then changes temperatures and durations of
/// the best of each number of visits while that helps. Deterministic. Stops after `max_evaluations`.
FoundProfile find_profile(const ChamberLimits& limits, double hours, const ProfileCost& cost, int max_evaluations);

// Inputs that a gyro would record on a profile: its temperature from the thermal response, others from what earlier
// recordings show.

/// How the gyro's temperature follows the chamber: d T/dt = (chamber + self_heating − T) / lag. The defaults are those
/// of the simulated gyro (simulated_gyro.hpp).
struct ThermalResponse {
  double lag_s = 65 * 60;  ///< >= 0; 0: the gyro's temperature is the chamber's
  double self_heating_degc = 4;
};

/// One recording on the grid of training: a row per window.
struct RecordedInputs {
  Eigen::MatrixXd inputs;  ///< d × N, in the inputs' units
  Eigen::VectorXd time_h;  ///< N, since the recording's start
  Eigen::VectorXd weight;  ///< N, of the noise; empty: all 1
};

/// Appends columns of the same number of rows; `all` may be empty.
void append_columns(Eigen::MatrixXd& all, const Eigen::MatrixXd& more);

/// Predicts inputs from profiles.
class GyroInputs {
 public:
  /// `recorded`: recordings whose rows show the inputs that T does not determine (U, sensors). Errors: such an input
  /// and no recording.
  static Result<GyroInputs> make(std::vector<std::string> names, const compensation::FeatureDefinition& features,
                                 const ThermalResponse& response, const std::vector<RecordedInputs>& recorded);

  /// The rows of a profile, one for each `windows` windows.
  RecordedInputs on(const simulation::ChamberProfile& profile, int windows = 1) const;

  /// `count` points evenly over the domain; inputs that it does not name follow T as in the recordings. Errors: a range
  /// of an input that the model does not have; no range of T.
  Result<Eigen::MatrixXd> over(const std::vector<InputRange>& domain, int count) const;

 private:
  /// One input as a line of T, dT/dt and T − EMA(T), and what is left: normal, correlated from row to row.
  struct Line {
    Eigen::Vector4d slope = Eigen::Vector4d::Zero();
    double sd = 0, kept = 0;
  };
  GyroInputs() = default;
  Eigen::VectorXd row(double t_degc, double slope_degc_per_s, double slow_degc, const std::vector<double>& noise) const;

  std::vector<std::string> names_;
  compensation::FeatureDefinition features_;
  ThermalResponse response_;
  std::vector<Line> lines_;  ///< one per input; unused for T and its slope
};

}  // namespace prism::design
