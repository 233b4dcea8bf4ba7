// SPDX-License-Identifier: MIT
// Dense matrices on the path in force: products, Cholesky factors and solves, as fast as the processor allows.
#pragma once

#include <Eigen/Core>

namespace prism::compensation {

/// c += sign · a aᵀ over the rows' common columns, lower triangle only; with weights: a diag(w) aᵀ. a is n × k, c n ×
/// n.
void add_gram(const Eigen::MatrixXd& a, Eigen::MatrixXd& c, const Eigen::VectorXd* weights = nullptr, double sign = 1);
/// The same over the columns [first, first + count) of a only.
void add_gram(const Eigen::MatrixXd& a, Eigen::Index first, Eigen::Index count, Eigen::MatrixXd& c,
              const Eigen::VectorXd* weights = nullptr, double sign = 1);

/// Lower Cholesky factor of a symmetric matrix, whose lower triangle alone is read. The upper triangle of `a` stays.
/// False where the matrix is not positive definite; `a` is then spoilt.
[[nodiscard]] bool cholesky(Eigen::MatrixXd& a);

/// x ← L⁻¹ x, x ← L⁻ᵀ x, and both: x ← (L Lᵀ)⁻¹ x, for the factor that cholesky() left in the lower triangle.
void solve_lower(const Eigen::MatrixXd& l, Eigen::VectorXd& x);
void solve_lower_transposed(const Eigen::MatrixXd& l, Eigen::VectorXd& x);
void solve_cholesky(const Eigen::MatrixXd& l, Eigen::VectorXd& x);

/// L⁻¹, with zeros above its diagonal.
Eigen::MatrixXd inverse_lower(const Eigen::MatrixXd& l);

}  // namespace prism::compensation
