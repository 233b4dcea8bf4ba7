// SPDX-License-Identifier: MIT
// Polynomials: linear least squares with an intercept (paper eq. 21), and stepwise regression.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::training {

/// The terms of a polynomial: powers of the inputs, one list per term (the intercept is implicit).
using TermPowers = std::vector<std::vector<int>>;
TermPowers cubic_terms();               ///< x, x², x³ of the only input (eq. 21)
TermPowers plain_terms(std::size_t d);  ///< every input itself
/// Inputs, squares and products of two (eqs. 22 and 24): T, T², dT/dt, (dT/dt)², …
TermPowers second_order_terms(std::size_t d);
/// One column per term, N × terms, from inputs d × N.
Eigen::MatrixXd columns_of(const Eigen::MatrixXd& inputs, const TermPowers& terms);
/// "T", "T^2", "T*dTdt".
std::string term_name(const std::vector<int>& powers, const std::vector<std::string>& names);

/// y = intercept + Σ coefficient_j · column_j, over the columns of one subset.
struct LinearFit {
  double intercept = 0;
  Eigen::VectorXd coefficient, t, p;  ///< one per column of the subset; p two-sided, Student's t with df
  double sse = 0;                     ///< sum of squared residuals
  int df = 0;                         ///< N − 1 − columns
  double sd() const;                  ///< √(sse / df); 0 if df is 0
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

// Stepwise regression (paper section 4.2): terms are added and removed by p-value, with a trace of every decision.

struct StepwiseSettings {
  std::vector<int> start;  ///< terms in the initial model
  double p_enter = 0.05;   ///< a term outside with a smaller p may enter, 0 to 1
  double p_remove = 0.10;  ///< a term inside with a larger p may leave, p_enter to 1
};

/// One entry of the trace. p contains the values of the decision: for "add" of the terms outside, else of those inside;
/// NaN for other terms and for terms that depend linearly on the model.
struct StepwiseStep {
  std::string action;                           ///< "initial", "add", "remove", "stop"
  int term = -1;                                ///< the term added or removed
  double p = 0, t = 0;                          ///< of that term
  std::vector<double> candidate_p, in_model_p;  ///< one per term
  std::vector<int> terms;                       ///< in the model after the step, ascending
};

struct PolynomialFit {
  std::vector<int> terms;          ///< ascending
  LinearFit fit;                   ///< over `terms`
  double condition = 1;            ///< of their design matrix
  std::vector<StepwiseStep> path;  ///< of stepwise regression
};

/// While a term outside has p < p_enter, the one with the smallest p enters; else, if a term inside has p > p_remove,
/// the one with the largest p leaves; else it stops. `columns` is N × m, one term per column; the intercept always
/// stays in. Errors: settings out of range, linearly dependent start terms, no convergence.
Result<PolynomialFit> fit_stepwise(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
                                   const StepwiseSettings& settings);

}  // namespace prism::training
