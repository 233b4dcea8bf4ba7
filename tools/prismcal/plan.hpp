// SPDX-License-Identifier: MIT
// Which recording to make next: the designed profile, what it is worth, and what others are worth.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/design_posterior.hpp"

namespace prism::design {

struct PlanSettings {
  ChamberLimits chamber;
  double hours = 8;  ///< > 0
  ThermalResponse response;
  std::vector<InputRange> domain;    ///< or `mission`
  Eigen::MatrixXd mission;           ///< d × M inputs that the model must serve; empty: the domain
  std::vector<RecordedInputs> made;  ///< further recordings, which the model was not trained on
};

struct Worth {
  std::string name;
  double hours = 0, sd_deg_per_h = 0;  ///< the sd after the recording
};

struct Plan {
  simulation::ChamberProfile profile;
  double spread_deg_per_h = 0;                       ///< of the bias, without any recording
  double before_deg_per_h = 0, after_deg_per_h = 0;  ///< sd
  std::vector<Worth> made;                           ///< recordings so far, each with those before it
  std::vector<Worth> others;                         ///< instead of the designed one
  double repeated_deg_per_h = 0;                     ///< the last recording made once more; 0: none
  int evaluations = 0;
  RecordedInputs expected;              ///< on the designed profile
  Eigen::VectorXd expected_t_degc;      ///< T of its rows
  Eigen::VectorXd domain_t_degc;        ///< T of each point of the domain
  Eigen::VectorXd sd_before, sd_after;  ///< at each point
  std::string assumed;                  ///< what the plan takes for granted; for the user
};

/// Some hundred points of recordings, for PlanSettings::mission; empty without recordings.
Eigen::MatrixXd mission_points(const std::vector<RecordedInputs>& recordings);

/// `gyros`: the gyro itself, or several of its type, of which the mean square counts. Errors: those of GyroInputs and
/// DesignPosterior; different inputs; a profile that does not fit into the hours.
Result<Plan> plan_recording(const std::vector<KnownGyro>& gyros, const PlanSettings& settings);

}  // namespace prism::design
