// SPDX-License-Identifier: MIT
// Robust weights: the paper's weight functions (eqs. 15 to 18) and robust scales (eqs. 19, 20).
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace prism::training {

enum class WeightKind { kNone, kHuber, kHampel, kLogistic, kMyriad };
const char* weight_name(WeightKind kind);
Result<WeightKind> parse_weight(std::string_view name);

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

/// v_k for every residual; all 1 if `scale` is 0.
Eigen::VectorXd weights_of(const Eigen::VectorXd& residuals, double scale, const WeightFunction& function);

/// An order statistic: the quantile at `share` (0 to 1). Not empty, no NaN.
double order_statistic(std::vector<double> values, double share);

}  // namespace prism::training
