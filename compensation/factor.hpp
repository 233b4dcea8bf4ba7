// SPDX-License-Identifier: MIT
// Cholesky factors for what is published: the same bits on every x86-64.
#pragma once

#include <Eigen/Core>

namespace prism::compensation {

/// Lower Cholesky factor in place, whose upper triangle stays; false where the matrix is not positive definite. Not
/// libprism-kernels' own, which differs in its last bits from level to level.
[[nodiscard]] bool lower_factor(Eigen::MatrixXd& matrix);

/// x ← L⁻¹ x and x ← (L Lᵀ)⁻¹ x for the factor that lower_factor() left.
void solve_factor(const Eigen::MatrixXd& factor, Eigen::VectorXd& x);
void solve_factored(const Eigen::MatrixXd& factor, Eigen::VectorXd& x);

}  // namespace prism::compensation
