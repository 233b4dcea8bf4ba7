// SPDX-License-Identifier: MIT
// Stepwise regression (paper section 4.2): terms are added and removed by p-value, with a trace of every decision.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/training/least_squares.hpp"

namespace prism::training {

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

struct StepwiseResult {
  std::vector<int> terms;  ///< ascending
  LinearFit fit;           ///< over `terms`
  double condition = 1;
  std::vector<StepwiseStep> path;
};

/// While a term outside has p < p_enter, the one with the smallest p enters; else, if a term inside has p > p_remove,
/// the one with the largest p leaves; else it stops. `columns` is N × m, one term per column; the intercept always
/// stays in. Errors: settings out of range, linearly dependent start terms, no convergence.
Result<StepwiseResult> fit_stepwise(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
                                    const StepwiseSettings& settings);

}  // namespace prism::training
