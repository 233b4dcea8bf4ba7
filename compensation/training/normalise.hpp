// SPDX-License-Identifier: MIT
// Engineering units → the normalised units of the kernel, with the constants for the way back.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/lssvm_model.hpp"

namespace prism::training {

enum class NormalisationMethod {
  kZscore,  ///< inputs by mean and sd (divisor N − 1), target by mean and sd (divisor N)
  kAuto,    ///< by column: two values → −1/+1; fewer than √N values → unchanged; else z-score
  kNone,
};

struct NormalisedData {
  Eigen::MatrixXd x;  ///< d × N, one sample per column
  Eigen::VectorXd y;  ///< N
  compensation::Normalisation constants;
};

/// `inputs` is d × N in engineering units. Errors: fewer than two samples; numbers that are not finite; a constant
/// input if it must be scaled (`where`: its name). A constant target keeps the scale 1.
Result<NormalisedData> normalise(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& target,
                                 NormalisationMethod scaling, const std::vector<std::string>& names);

/// Normalises new samples with known constants.
Eigen::MatrixXd normalised_inputs(const Eigen::MatrixXd& inputs, const compensation::Normalisation& constants);

}  // namespace prism::training
