// SPDX-License-Identifier: MIT
// Stepwise regression (paper section 4.2): terms come in by p-value and go out by p-value, and the trace says why.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/training/least_squares.hpp"

namespace prism::training {

struct StepwiseSettings {
  std::vector<int> start;  ///< terms in the model at the beginning
  double p_enter = 0.05;   ///< a term outside with a smaller p may enter, 0 to 1
  double p_remove = 0.10;  ///< a term inside with a larger p may leave, p_enter to 1
};

/// One entry of the trace. p holds what was decided by: for "add" the terms outside, else those inside; NaN where a
/// term is not concerned or depends linearly on the model.
struct StepwiseStep {
  std::string action;                           ///< "initial", "add", "remove", "stop"
  int term = -1;                                ///< added or removed
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
/// the one with the largest p leaves; else it stops. `columns` is N × m, one term a column; the intercept always stays
/// in. Refuses settings out of range, linearly dependent start terms, and a search that runs in circles.
Result<StepwiseResult> fit_stepwise(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
                                    const StepwiseSettings& settings);

}  // namespace prism::training
