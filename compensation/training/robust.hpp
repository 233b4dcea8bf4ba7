// SPDX-License-Identifier: MIT
// Outliers: robust weights and scales, re-weighting (paper section 2.3: solve, weight by the residuals, solve again),
// and gross outliers, which are removed before a robust training, so that its start does not depend on them.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "compensation/training/held_out.hpp"

namespace prism::training {

// Robust weights: the paper's weight functions (eqs. 15 to 18) and robust scales (eqs. 19, 20).

enum class WeightKind { kNone, kHuber, kHampel, kLogistic, kMyriad };
const char* weight_name(WeightKind kind);
/// "huber", "hampel", "logistic", "myriad"; kNone for any other word.
WeightKind weight_by_name(std::string_view name);

/// v(u) for u = residual / scale.
struct WeightFunction {
  WeightKind kind = WeightKind::kNone;
  /// Huber's beta (1 if |u| < beta, else beta / |u|) or myriad's delta (delta² / (delta² + u²)); > 0; unused for
  /// others.
  double parameter = 1;
  /// Hampel: 1 up to |u| = 2.5, falling to 0 at 3; above 3 this value. 0 drops the sample as in eq. 16; LS-SVMlab uses
  /// 1e-7.
  double hampel_floor = 1e-7;

  double operator()(double u) const;
  bool has_parameter() const { return kind == WeightKind::kHuber || kind == WeightKind::kMyriad; }
};

/// The default parameter: Huber 1.345 (95 % efficiency for normal data), myriad 1.
inline double usual_parameter(WeightKind kind) { return kind == WeightKind::kHuber ? 1.345 : 1; }

/// Eq. 20 with the paper's digits, for all training estimates: the published models and the goldens depend on it.
/// Statistics of records and lots use evaluation::kMadToSd.
inline constexpr double kPaperMadToSd = 1.483;

enum class ScaleKind {
  kMad,  ///< eq. 20: kPaperMadToSd · median |r − median r|
  kIqr,  ///< eq. 19: (q75 − q25) / (2 · 0.6745), quartiles at n p + 0.5
};

/// Robust standard deviation of residuals (at least one). If more than half of them are equal, returns the larger of
/// both definitions, then the mean deviation; 0 only if all are equal.
double robust_scale(const Eigen::VectorXd& residuals, ScaleKind kind);

/// A kernel matrix in extended precision (80 bits on x86-64): N² · 16 bytes.
using ExtendedMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

struct ReweightSettings {
  WeightFunction weight;  ///< kNone: plain LSSVM, no re-weighting
  ScaleKind scale = ScaleKind::kMad;
  double min_weight = 0;  ///< for solvers that cannot use a weight of zero
  int limit = 500;        ///< maximum number of weighted solves; 1 is the paper's algorithm
  /// Converged if the 2-norm of the change of alpha is at most this (LS-SVMlab's rule, normalised units), or below the
  /// rounding limit of a system with this c.
  double tolerance = 1e-4;
  /// If given, every solve is refined with this matrix over the same samples (not owned). Needed if the re-weighting is
  /// chaotic (Hampel between two states), because rounding would grow from solve to solve.
  const ExtendedMatrix* extended = nullptr;
};

struct ReweightReport {
  int solves = 0;  ///< number of weighted solves
  bool converged = false;
  bool oscillating = false;  ///< the weights alternated between two states; the result is their mean
  double scale = 0;          ///< robust scale of the last weights
  int dropped = 0;           ///< number of samples with weight zero
};

/// The weights and residuals before and after one re-weighting.
struct ReweightStep {
  const Eigen::VectorXd &weight_before, &weight, &residual_before, &residual;
};
enum class AfterStep { kContinue, kConverged, kStop };

/// Solves with these weights and returns the residuals.
using WeightedSolve = std::function<Result<Eigen::VectorXd>(const Eigen::VectorXd& weight)>;
/// Decides after each step. After it sets report.oscillating, new weights are averaged with the previous ones.
using StepRule = std::function<AfterStep(const ReweightStep& step, ReweightReport& report)>;

/// Weights by eqs. 15 to 20. `weight`: first weights in, weights of the last solve out. Errors: those of `solve`.
Result<ReweightReport> reweight(const ReweightSettings& settings, Eigen::VectorXd& weight, const WeightedSolve& solve,
                                const StepRule& rule);

/// Converged if no residual changed by more than `tolerance` scales.
StepRule residuals_within(double tolerance);
/// Converged if no weight changed by 1e-3 or more. After 20 solves weights are averaged, so that an alternation between
/// two states ends at their mean.
StepRule weights_settled();

// Gross outliers of the target.

inline constexpr double kGross = 60;
/// Simulated gyros without outliers stay below 5, real chamber records do not.
inline constexpr double kSuspect = 8;

/// Rows whose target is far from the median of the 65 rows around them in their recording, and from that of the 65 rows
/// with the nearest inputs: more than `scales` robust scales (MAD) of all such distances, both times. In order. Clean
/// records stay below 41 (docs/compensation.md); smaller outliers are left to the robust weights. None with fewer than
/// 20 rows. An excursion of the inputs that is unique and shorter than 30 rows counts as well. `inputs` is d × N;
/// `runs`: recording of each row. O(N · min(N, 2000)).
Rows gross_outliers(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& target, const std::vector<int>& runs,
                    double scales = kGross);

/// Rows counted from 1, as ranges: "12, 50 to 57 and 3 others".
std::string rows_text(const Rows& rows);

}  // namespace prism::training
