// SPDX-License-Identifier: MIT
// The error of the paper's models in a new run, estimated from blocks of the training record.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "compensation/model.hpp"
#include "compensation/training/folds.hpp"
#include "compensation/training/normalise.hpp"

namespace prism::training {

/// A variance above this multiple of the quantile at the training samples is `extrapolating`: 2 % of a repeat of the
/// training profile, 90 % of the large errors 15 degC outside it (docs/benchmarks.md).
inline constexpr double kGuardFactor = 12, kGuardQuantile = 0.99;

/// Enough samples for the estimate; longer records use every n-th sample.
inline constexpr Eigen::Index kErrorSamples = 1000;

/// A prior, chosen on simulated gyros (docs/benchmarks.md): two runs of a gyro with one recording differ by
/// compensation::kAssumedOffset of the sd of its bias and, with the composite kernel, by this multiple of the variance
/// of the drift within the recording.
inline constexpr double kDaysDiffer = 1.5;

/// Samples of the record, each predicted by a model without its fold; deg/h. Empty if the record is too short.
struct HeldOutErrors {
  Eigen::VectorXd error;           ///< target − prediction
  Eigen::VectorXd model_variance;  ///< of the prediction, (deg/h)²; 0 if the model type has none
  Folds folds;
  std::vector<Eigen::Index> samples;  ///< columns of the training data
};

/// One fold per recording if there are at least three, else ten blocks; empty if the record is too short. `recordings`:
/// of each sample, in order of time.
Folds held_out_folds(const std::vector<int>& recordings);

/// Cross-conformal (Vovk 2015): the nuisance with which 95 % of the errors are within 2 sd_mean. The noise is the
/// difference of neighbouring residuals of the training (deg/h); with a single recording, the offset is kAssumedOffset
/// of the target's sd. Returns nullopt without folds.
std::optional<compensation::BetweenRunError> between_run_error_of(const HeldOutErrors& held,
                                                                  const Eigen::VectorXd& residual, double target_sd,
                                                                  const std::vector<int>& recordings);

/// An LSSVM with fixed weights v; samples without a weight are left out.
HeldOutErrors hold_out_lssvm(const NormalisedData& data, const Eigen::VectorXd& weight,
                             const std::vector<int>& recordings, double c, double sigma2);

}  // namespace prism::training
