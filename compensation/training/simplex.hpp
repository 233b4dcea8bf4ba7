// SPDX-License-Identifier: MIT
// Minimisation without derivatives: Nelder and Mead's simplex within a box.
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

}  // namespace prism::training
