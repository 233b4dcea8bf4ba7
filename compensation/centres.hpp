// SPDX-License-Identifier: MIT
// What the kernel models have in common: their centres.
#pragma once

#include <Eigen/Core>
#include <string>

#include "compensation/model.hpp"

namespace prism::compensation {

/// The matrix in its order of storage, exact (model_id.hpp).
std::string exact_numbers(const Eigen::MatrixXd& matrix);

/// What is wrong with `centres` [inputs x n] for a model of these inputs with so many alphas; empty: nothing.
std::string wrong_centres(const ModelInfo& info, const Eigen::MatrixXd& centres, Eigen::Index alphas);

}  // namespace prism::compensation
