// SPDX-License-Identifier: MIT
// Minimisation with gradients: BFGS with a backtracking line search.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace prism::training {

/// The value at x, and its gradient; not finite where x is impossible.
using SmoothFunction = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

struct QuasiNewtonSettings {
  int max_evaluations = 100;
  double max_step = 1;              ///< longest move of any coordinate in one step
  double f_tolerance = 1e-7;        ///< ends where a step wins less than this ...
  double g_tolerance = 1e-4;        ///< ... or where no slope is steeper
  Eigen::MatrixXd inverse_hessian;  ///< what is known of it at the start; empty: nothing
};

struct QuasiNewtonResult {
  Eigen::VectorXd x;
  double value = 0;
  int evaluations = 0;
  Eigen::MatrixXd inverse_hessian;  ///< as the steps showed it: a start for a like problem
};

/// Broyden, Fletcher, Goldfarb and Shanno (1970) on the inverse Hessian; Armijo's condition with quadratic
/// interpolation (Nocedal and Wright, Numerical Optimization, 2006, chapters 3 and 6). Updates without curvature are
/// left out. Ends early where `stop` says so.
QuasiNewtonResult minimise_smooth(const SmoothFunction& f, const Eigen::VectorXd& start,
                                  const QuasiNewtonSettings& settings, const std::function<bool()>& stop);

}  // namespace prism::training
