// SPDX-License-Identifier: MIT
// Engineering units → the units that the kernel works in, with the constants that lead back.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/lssvm_model.hpp"

namespace prism::training {

enum class Scaling {
  kZscore,  ///< inputs by mean and sd (divisor N − 1), target by mean and sd (divisor N)
  kAuto,    ///< by column: two values → −1/+1; fewer than √N values → as they are; else z-score
  kNone,
};

enum class ColumnKind { kContinuous, kBinary, kCategorical };

struct NormalisedData {
  Eigen::MatrixXd x;  ///< d × N, one sample a column
  Eigen::VectorXd y;  ///< N
  compensation::Normalisation constants;
  std::vector<ColumnKind> kinds;  ///< d inputs, then the target
};

/// `inputs` is d × N in engineering units. Refuses fewer than two samples, numbers that are not finite and, where it
/// must be scaled, an input that does not move (where: its name). A target that does not move keeps the scale 1.
Result<NormalisedData> normalise(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& target, Scaling scaling,
                                 const std::vector<std::string>& names);

/// New samples by known constants.
Eigen::MatrixXd normalised_inputs(const Eigen::MatrixXd& inputs, const compensation::Normalisation& constants);

}  // namespace prism::training
