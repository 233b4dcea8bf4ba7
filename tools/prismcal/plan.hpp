// SPDX-License-Identifier: MIT
// Which recording to make next: the designed profile, what it is worth, and what others are worth. A recording is
// judged by the standard deviation that a model will state after it, from its inputs alone.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/composite_model.hpp"
#include "tools/prismcal/profiles.hpp"

namespace prism::design {

/// A gyro as a composite model describes it: its covariance, and the recordings made so far.
struct KnownGyro {
  std::string name;
  std::vector<std::string> inputs;
  compensation::FeatureDefinition features;
  compensation::CompositeVariances variances;
  compensation::Normalisation normalisation;
  compensation::BetweenRunError spread;
  std::vector<RecordedInputs> recordings;  ///< empty: none, or a long record of which only `gram` is left
  Eigen::MatrixXd centres, gram;           ///< of a long record (CompositeParameters)
  compensation::ModelPtr model;
};

/// Errors: not a composite model, a model of a table.
Result<KnownGyro> known_gyro(const compensation::ModelPtr& model);

/// Gaussian process: the posterior variance depends on the inputs and the covariance, not on the measured bias, so that
/// a recording can be judged before it is made (I-optimality; Cohn, Ghahramani and Jordan 1996). The bias is expressed
/// over a few pivots of the kernel; each recording adds Ψ Λ⁻¹ Ψᵀ to the information, Λ the covariance of its nuisance,
/// offset and noise (NuisanceFilter).
class DesignPosterior {
 public:
  /// `domain`: points that the model must serve, `reachable`: points that recordings may visit; d × M each. Starts
  /// without recordings. `first_h`: length of the first recording, whose model will see the drift of these hours; 0:
  /// the gyro's own model has seen it. Errors: a covariance that is not positive definite.
  static Result<DesignPosterior> make(const KnownGyro& gyro, const Eigen::MatrixXd& domain,
                                      const Eigen::MatrixXd& reachable, double first_h);

  /// Adds a recording; `windows`: number of windows in the mean of each row.
  void add(const RecordedInputs& recording, int windows = 1);
  /// Starts from the information of the gyro's long record.
  void add_long_record();

  /// Root of the mean square of the stated sd over the domain (extrapolation.hpp, shrunk()), deg/h, skill 1. Without a
  /// recording: the spread of the bias.
  double sd_deg_per_h() const;
  /// The sd at each point of the domain.
  Eigen::VectorXd sd_at_points() const;
  /// sd_deg_per_h() if this recording is added.
  double sd_with(const RecordedInputs& recording, int windows = 1) const;

 private:
  DesignPosterior() = default;
  void set_between_runs(double first_h);
  double own_part() const;
  compensation::Prediction predicted(Eigen::Index point, double variance) const;
  Eigen::MatrixXd features_of(const Eigen::MatrixXd& inputs) const;

  KnownGyro gyro_;                         // its spread as set_between_runs() leaves it
  Eigen::MatrixXd points_, factor_;        // pivots, normalised; factor of their covariance
  Eigen::MatrixXd domain_features_;        // (r + 2) × M
  Eigen::VectorXd left_, bias_deg_per_h_;  // of the domain: prior variance outside the pivots; bias minus its mean
  Eigen::MatrixXd information_;            // (r + 2)²: pivots, warm-up, constant
  double drift_ = 0;                       // variance of the drift within a run
  double two_runs_ = 0;  // prior of the variance of the difference between two runs; 0: variances_.offset determines it
  bool empty_ = true;
};

// The plan.

struct PlanSettings {
  ChamberLimits chamber;
  double hours = 8;  ///< > 0
  ThermalResponse response;
  std::vector<InputRange> domain;
};

/// A recording, and the sd after it.
struct Worth {
  std::string name;
  double hours = kUnknown, sd_deg_per_h = 0;
};

struct Plan {
  simulation::ChamberProfile profile;
  std::vector<Worth> made;          ///< each recording with those before it; first: no recording
  double after_deg_per_h = 0;       ///< sd after the designed profile
  std::vector<Worth> others;        ///< instead of it: the paper's cycle, simple profiles, the last recording once more
  RecordedInputs expected;          ///< on the designed profile
  Eigen::VectorXd expected_t_degc;  ///< T of its rows
  std::string assumed;              ///< what the plan takes for granted; for the user

  double before_deg_per_h() const { return made.back().sd_deg_per_h; }
};

/// `gyros`: the gyro itself, or several of its type, of which the mean square counts. Errors: those of GyroInputs and
/// DesignPosterior; different inputs; a profile that does not fit into the hours.
Result<Plan> plan_recording(const std::vector<KnownGyro>& gyros, const PlanSettings& settings);

}  // namespace prism::design
