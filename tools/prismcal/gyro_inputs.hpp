// SPDX-License-Identifier: MIT
// The inputs that a gyro would record on a chamber profile: its temperature from the thermal response, other inputs
// from what earlier recordings show.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/features.hpp"
#include "tools/prismcal/profiles.hpp"

namespace prism::design {

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
