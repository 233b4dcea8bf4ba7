// SPDX-License-Identifier: MIT
// Held-out data: folds, the residuals of each fold without it, and the error in a new run that these show.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "base/result.hpp"
#include "compensation/model.hpp"

namespace prism::training {

/// Sample numbers, ascending.
using Rows = std::vector<Eigen::Index>;

/// One fold number per sample, 0 to k − 1; every fold has samples.
using Folds = std::vector<int>;

/// A permutation by the seed, divided into k parts of floor(n / k); the last contains the rest (as in LS-SVMlab).
Folds shuffled_folds(std::size_t n, int k, std::uint64_t seed);

/// k contiguous blocks that never span two runs: each run has its share of the k (at least one). `runs` is the run of
/// each sample, in order of time. For time series: neighbours are held out together.
Folds blocked_folds(const std::vector<int>& runs, int k);

/// Fold numbers of a column (any integers) → 0 to k − 1. Errors: fewer than two folds.
Result<Folds> folds_from(const std::vector<double>& column);

/// Numbers of folds or recordings without gaps, in the same order.
std::vector<int> numbered(const std::vector<int>& numbers);

int fold_count(const Folds& folds);
/// Every n-th row, so that at most `most` remain.
Rows thinned(Eigen::Index rows, Eigen::Index most);
/// The folds or recordings of these rows.
std::vector<int> taken(const std::vector<int>& of_rows, const Rows& rows);
/// The rows of 0 to `count` − 1 that are not in `members`.
Rows others(const Rows& members, Eigen::Index count);
/// Indices of each fold's samples.
std::vector<Rows> fold_members(const Folds& folds);

/// The residuals of each fold's members: `residual(rest, members)` fits the rest, and is empty if it cannot. The
/// result is empty if one of them is.
using FoldResidual = std::function<Eigen::VectorXd(const Rows& rest, const Rows& members)>;
Eigen::VectorXd held_out(const Folds& folds, const FoldResidual& residual);

/// Mean over folds of the mean absolute residual of each.
double mean_of_folds(const Eigen::VectorXd& residual, const Folds& folds);

/// An order statistic: the quantile at `share` (0 to 1). Not empty, no NaN.
double order_statistic(std::vector<double> values, double share);

// The error of a model in a new run, estimated from blocks of the training record.

/// 12 times the 99 % quantile of the variances at the training samples; `none` without them. A larger variance is
/// `extrapolating`: 2 % of a repeat of the training profile, 90 % of the large errors 15 degC outside it
/// (docs/benchmarks.md).
double guard_of(std::vector<double> variances, double none);

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
  Rows samples;  ///< columns of the training data
};

/// One fold per recording if there are at least three, else ten blocks; empty if the record is too short. `recordings`:
/// of each sample, in order of time.
Folds held_out_folds(const std::vector<int>& recordings);

/// held_out() of these samples by held_out_folds(), for a model type without variance; `scale`: of the residuals.
HeldOutErrors held_out_errors(Rows samples, const std::vector<int>& recordings, double scale,
                              const FoldResidual& residual);

/// Cross-conformal (Vovk 2015): the nuisance with which 95 % of the errors are within 2 sd_mean. The noise is the
/// difference of neighbouring residuals of the training (deg/h); with a single recording, the offset is kAssumedOffset
/// of the target's sd. Returns nullopt without folds.
std::optional<compensation::BetweenRunError> between_run_error_of(const HeldOutErrors& held,
                                                                  const Eigen::VectorXd& residual, double target_sd,
                                                                  const std::vector<int>& recordings);

/// The settings of the model's monitor by its held-out errors; nullopt: too few. `time_s`: of the training samples.
std::optional<compensation::MonitorSettings> monitor_of(const HeldOutErrors& held,
                                                        const compensation::BetweenRunError& spread,
                                                        const std::vector<int>& recordings,
                                                        const Eigen::VectorXd& time_s, double window_s);

}  // namespace prism::training
