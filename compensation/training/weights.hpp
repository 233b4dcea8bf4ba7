// SPDX-License-Identifier: MIT
// How little a sample far off counts: the paper's weight functions (eqs. 15 to 18) and robust scales (eqs. 19, 20).
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
  /// Huber's beta (1 if |u| < beta, else beta / |u|) or myriad's delta (delta² / (delta² + u²)); > 0; others have none.
  double parameter = 1;
  /// Hampel: 1 to |u| = 2.5, falling to 0 at 3; beyond it this. 0 drops the sample as eq. 16 says; LS-SVMlab keeps
  /// 1e-7.
  double hampel_floor = 1e-7;

  double operator()(double u) const;
  bool has_parameter() const { return kind == WeightKind::kHuber || kind == WeightKind::kMyriad; }
};

/// The parameter where nobody gave or tuned one: Huber 1.345 (95 % efficiency at the normal), myriad 1.
inline double usual_parameter(WeightKind kind) { return kind == WeightKind::kHuber ? 1.345 : 1; }

/// Eq. 20 as the paper prints it, for everything that training estimates: the published models and the goldens hold its
/// digits. Statistics of records and lots use evaluation::kMadToSd.
inline constexpr double kPaperMadToSd = 1.483;

enum class ScaleKind {
  kMad,  ///< eq. 20: kPaperMadToSd · median |r − median r|
  kIqr,  ///< eq. 19: (q75 − q25) / (2 · 0.6745), quartiles at n p + 0.5
};

/// Robust standard deviation of residuals (at least one). Where more than half of them are equal the wider of both
/// definitions serves, then the mean deviation; 0 only where all are equal.
double robust_scale(const Eigen::VectorXd& residuals, ScaleKind kind);

/// v_k for every residual; all 1 where `scale` is 0.
Eigen::VectorXd weights_of(const Eigen::VectorXd& residuals, double scale, const WeightFunction& function);

/// An order statistic: the value that `share` (0 to 1) of the values do not pass. Not empty, no NaN.
double order_statistic(std::vector<double> values, double share);

}  // namespace prism::training
