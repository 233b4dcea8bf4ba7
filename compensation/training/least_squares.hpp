// SPDX-License-Identifier: MIT
// Linear least squares with an intercept (paper eq. 21), and the statistics for stepwise regression.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/result.hpp"

namespace prism::training {

/// y = intercept + Σ coefficient_j · column_j, over the columns of one subset.
struct LinearFit {
  double intercept = 0;
  Eigen::VectorXd coefficient, standard_error, t,
      p;              ///< one per column of the subset; p two-sided, Student's t with df
  double sse = 0;     ///< sum of squared residuals
  int df = 0;         ///< N − 1 − columns
  double sd() const;  ///< √(sse / df); 0 if df is 0
};

/// One QR of all centred and scaled columns in long double; every subset is then solved from its small triangle,
/// exactly as from the data.
class LinearProblem {
 public:
  /// `columns` is N × m, finite, y N; each fitted subset requires N > m + 1.
  LinearProblem(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y);

  /// Errors: columns of the subset are linearly dependent or constant; more terms than the data allow.
  Result<LinearFit> fit(const std::vector<int>& subset) const;
  /// Condition number of the subset's design matrix, intercept included, columns scaled to length 1.
  double condition(const std::vector<int>& subset) const;

 private:
  using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;
  Eigen::Index n_;
  Vector mean_, scale_;  // m columns, then y
  Matrix triangle_;      // (m + 1)²: R of the QR of [columns y], centred and scaled
};

}  // namespace prism::training
