// SPDX-License-Identifier: MIT
// How far a run that was not seen lies from what a model of the paper's says: from blocks of its own record.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "compensation/model.hpp"
#include "compensation/training/folds.hpp"
#include "compensation/training/normalise.hpp"

namespace prism::training {

/// A variance beyond so many times the quantile of those at the training samples is `extrapolating`: 2 % of a repeat of
/// the training profile, 90 % of the large errors 15 degC beyond it (docs/science.md).
inline constexpr double kGuardFactor = 12, kGuardQuantile = 0.99;

/// Enough samples to judge by; of a longer record every n-th.
inline constexpr Eigen::Index kSpreadSamples = 1000;

/// Samples of the record, each predicted by a model that did not see its fold; deg/h.
struct HeldOutErrors {
  Eigen::VectorXd error;           ///< target − prediction
  Eigen::VectorXd model_variance;  ///< of the prediction, (deg/h)²; 0 where the kind has none
  Folds folds;
};

/// Recordings where there are at least three, else ten blocks; empty where the record is too short to say anything.
/// `recordings`: of each sample, in order of time.
Folds spread_folds(const std::vector<int>& recordings);

/// Cross-conformal (Vovk 2015): the nuisance by which 95 % of the errors lie within 2 sd_mean, with the noise by which
/// neighbouring residuals of the training (deg/h) differ and, of one recording, kAssumedOffset of the target's sd. None
/// where there are no folds.
std::optional<compensation::Spread> spread_of(const HeldOutErrors& held, const Eigen::VectorXd& residual,
                                              double target_sd, const std::vector<int>& recordings);

/// An LSSVM with its weights v frozen; samples without one are left out.
HeldOutErrors hold_out_lssvm(const NormalisedData& data, const Eigen::VectorXd& weight,
                             const std::vector<int>& recordings, double c, double sigma2);

}  // namespace prism::training
