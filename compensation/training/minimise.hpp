// SPDX-License-Identifier: MIT
// Minimisation without gradients, Nelder and Mead's simplex within a box, and with them: BFGS with a line search.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace prism::training {

struct SimplexSettings {
  Eigen::VectorXd lower, upper;  ///< the box; points outside are moved onto it
  double step = 1;               ///< edge length of the first simplex, > 0
  int max_evaluations = 100;
  double x_tolerance = 1e-3, f_tolerance = 1e-7;  ///< largest edge; relative range of the values: both must be reached
};

struct Minimum {
  Eigen::VectorXd x;
  double value = 0;
  Eigen::MatrixXd inverse_hessian;  ///< BFGS: estimate from the steps, an initial estimate for a similar problem
};

/// Nelder and Mead (1965): reflection 1, expansion 2, contraction and shrinkage ½. Stops early if `stop` returns true.
Minimum minimise(const std::function<double(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& start,
                 const SimplexSettings& settings, const std::function<bool()>& stop);

/// The value at x, and its gradient; not finite if x is invalid.
using SmoothFunction = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

/// Broyden, Fletcher, Goldfarb and Shanno (1970) on the inverse Hessian; Armijo's condition with quadratic
/// interpolation (Nocedal and Wright, Numerical Optimization, 2006, chapters 3 and 6). Skips updates without curvature.
/// No coordinate moves by more than 1 in a step. Ends after a step that improves a log likelihood by less than 1e-4,
/// because a smaller difference distinguishes no models; at a gradient below 1e-3; or if `stop` returns true.
/// `inverse_hessian`: initial estimate; empty: unknown.
Minimum minimise_smooth(const SmoothFunction& f, const Eigen::VectorXd& start, int max_evaluations,
                        const Eigen::MatrixXd& inverse_hessian, const std::function<bool()>& stop);

}  // namespace prism::training
