// SPDX-License-Identifier: MIT
// Functions of the kernel models for their centres.
#pragma once

#include <Eigen/Core>
#include <string>

#include "compensation/model.hpp"

namespace prism::compensation {

/// The numbers in storage order, exact (model_id.hpp).
std::string exact_numbers(const Eigen::MatrixXd& matrix);

/// Returns the error in `centres` [inputs x n] for a model with these inputs and this number of alphas; empty if valid.
std::string wrong_centres(const ModelInfo& info, const Eigen::MatrixXd& centres, Eigen::Index alphas);

}  // namespace prism::compensation
