// SPDX-License-Identifier: MIT
// Minimisation without and with derivatives.
// Without: Nelder and Mead's simplex within a box.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace prism::training {

struct SimplexSettings {
  Eigen::VectorXd lower, upper;  ///< the box; points outside are moved onto it
  Eigen::VectorXd step;          ///< edge lengths of the first simplex, > 0
  int max_evaluations = 100;
  double x_tolerance = 1e-3, f_tolerance = 1e-7;  ///< largest edge; relative range of the values: both must be reached
};

struct SimplexResult {
  Eigen::VectorXd x;
  double value = 0;
  int evaluations = 0;
};

/// Nelder and Mead (1965): reflection 1, expansion 2, contraction and shrinkage ½. Stops early if `stop` returns true.
SimplexResult minimise(const std::function<double(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& start,
                       const SimplexSettings& settings, const std::function<bool()>& stop);

// Minimisation with gradients: BFGS with a backtracking line search.

/// The value at x, and its gradient; not finite if x is invalid.
using SmoothFunction = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

struct QuasiNewtonSettings {
  int max_evaluations = 100;
  double max_step = 1;              ///< longest step of any coordinate
  double f_tolerance = 1e-7;        ///< stops if a step improves by less than this ...
  double g_tolerance = 1e-4;        ///< ... or if no component of the gradient is larger
  Eigen::MatrixXd inverse_hessian;  ///< initial estimate; empty: unknown
};

struct QuasiNewtonResult {
  Eigen::VectorXd x;
  double value = 0;
  int evaluations = 0;
  Eigen::MatrixXd inverse_hessian;  ///< estimate from the steps: an initial estimate for a similar problem
};

/// Broyden, Fletcher, Goldfarb and Shanno (1970) on the inverse Hessian; Armijo's condition with quadratic
/// interpolation (Nocedal and Wright, Numerical Optimization, 2006, chapters 3 and 6). Skips updates without curvature.
/// Stops early if `stop` returns true.
QuasiNewtonResult minimise_smooth(const SmoothFunction& f, const Eigen::VectorXd& start,
                                  const QuasiNewtonSettings& settings, const std::function<bool()>& stop);

}  // namespace prism::training
