// SPDX-License-Identifier: MIT
// Cholesky factors for published values: the same bits on every x86-64 processor.
#pragma once

#include <Eigen/Core>

namespace prism::compensation {

/// Lower Cholesky factor in place; the upper triangle is unchanged. Returns false if the matrix is not positive
/// definite. Not the function of libprism-kernels, whose last bits differ between microarchitecture levels.
[[nodiscard]] bool lower_factor(Eigen::MatrixXd& matrix);

/// x ← L⁻¹ x and x ← (L Lᵀ)⁻¹ x for the factor of lower_factor().
void solve_factor(const Eigen::MatrixXd& factor, Eigen::VectorXd& x);
void solve_factored(const Eigen::MatrixXd& factor, Eigen::VectorXd& x);

}  // namespace prism::compensation
