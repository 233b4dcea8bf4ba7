// SPDX-License-Identifier: MIT
// Dense matrices at the processor's microarchitecture level: products, Cholesky factors and solves of libprism-kernels.
#pragma once

#include <Eigen/Core>
#include <cassert>
#include <span>

#include "compensation/kernels/kernels.hpp"

namespace prism::training {

inline std::span<const double> column(const Eigen::MatrixXd& m, Eigen::Index j) {
  return {m.data() + j * m.rows(), static_cast<std::size_t>(m.rows())};
}

/// c += sign · a aᵀ, lower triangle only; with weights: a diag(w) aᵀ. a is n × k, c n × n.
inline void add_gram(const Eigen::MatrixXd& a, Eigen::MatrixXd& c, const Eigen::VectorXd* weights = nullptr,
                     double sign = 1) {
  assert(c.rows() == a.rows() && c.cols() == a.rows() && (!weights || weights->size() == a.cols()));
  kernels::add_gram(a.data(), static_cast<std::size_t>(a.rows()), static_cast<std::size_t>(a.cols()),
                    weights ? weights->data() : nullptr, sign, c.data());
}

/// Lower Cholesky factor of a symmetric matrix; reads the lower triangle only and does not change the upper one.
/// Returns false if the matrix is not positive definite; `a` is then overwritten.
[[nodiscard]] inline bool cholesky(Eigen::MatrixXd& a) {
  return kernels::cholesky(a.data(), static_cast<std::size_t>(a.rows()));
}

/// x ← L⁻¹ x, x ← L⁻ᵀ x, and both: x ← (L Lᵀ)⁻¹ x, for the lower triangle of cholesky().
inline void solve_lower(const Eigen::MatrixXd& l, Eigen::VectorXd& x) {
  assert(x.size() == l.rows());
  kernels::solve_lower(l.data(), static_cast<std::size_t>(l.rows()), x.data());
}
inline void solve_lower_transposed(const Eigen::MatrixXd& l, Eigen::VectorXd& x) {
  assert(x.size() == l.rows());
  kernels::solve_lower_transposed(l.data(), static_cast<std::size_t>(l.rows()), x.data());
}
inline void solve_cholesky(const Eigen::MatrixXd& l, Eigen::VectorXd& x) {
  solve_lower(l, x);
  solve_lower_transposed(l, x);
}

/// L⁻¹, with zeros above its diagonal.
inline Eigen::MatrixXd inverse_lower(const Eigen::MatrixXd& l) {
  Eigen::MatrixXd w(l.rows(), l.cols());
  kernels::invert_lower(l.data(), static_cast<std::size_t>(l.rows()), w.data());
  return w;
}

}  // namespace prism::training
