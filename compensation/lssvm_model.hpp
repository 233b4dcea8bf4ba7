// SPDX-License-Identifier: MIT
// Prediction by a trained LSSVM or IR-LSSVM (paper eqs. 10 and 11), with the standard deviation its matrices give.
#pragma once

#include <Eigen/Core>

#include "compensation/model.hpp"

namespace prism {

/// Shift and scale between engineering units and the units the kernel works in: n = (x − shift) / scale.
struct Normalisation {
  Eigen::VectorXd input_shift, input_scale;  ///< d each; scale > 0
  double target_shift = 0, target_scale = 1;
};

/// f(x) = Σ alpha_k exp(−‖n(x) − centre_k‖² / (2 sigma2)) + b;  bias = f · target_scale + target_shift.
struct LssvmParameters {
  Eigen::MatrixXd centres;  ///< d × N, normalised, one centre a column
  Eigen::VectorXd alpha;    ///< N
  Eigen::VectorXd weight;   ///< N, the v_k of eq. 14, > 0; all 1 when not re-weighted
  double b = 0;
  double c = 1;       ///< > 0
  double sigma2 = 1;  ///< > 0, in normalised units
  Normalisation normalisation;
};

}  // namespace prism
