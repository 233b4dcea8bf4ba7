// SPDX-License-Identifier: MIT
// Products, factors and solves: Eigen, on matrices that the caller owns.
#if defined(__AVX512F__) && !defined(__clang__)  // g++ 12 warns about its own intrinsics
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <Eigen/Cholesky>
#include <algorithm>

#include "compensation/kernels/kernels.hpp"

namespace prism::kernels {
namespace {

using Eigen::Index;
using Matrix = Eigen::Map<Eigen::MatrixXd>;
using ConstMatrix = Eigen::Map<const Eigen::MatrixXd>;

ConstMatrix matrix(const double* values, std::size_t rows, std::size_t columns) {
  return {values, static_cast<Index>(rows), static_cast<Index>(columns)};
}
Matrix matrix(double* values, std::size_t rows, std::size_t columns) {
  return {values, static_cast<Index>(rows), static_cast<Index>(columns)};
}

}  // namespace

void add_gram(const double* a, std::size_t n, std::size_t k, const double* weights, double sign, double* c) {
  if (n == 0 || k == 0) return;  // Eigen divides by them
  const ConstMatrix left = matrix(a, n, k);
  auto lower = matrix(c, n, n).triangularView<Eigen::Lower>();
  if (weights) {
    const Eigen::MatrixXd right = left * (sign * matrix(weights, k, 1)).asDiagonal();
    lower += left * right.transpose();
  } else {
    lower += sign * left * left.transpose();
  }
}

bool cholesky(double* a, std::size_t n) {
  Eigen::Ref<Eigen::MatrixXd> factor(matrix(a, n, n));
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(factor);
  return llt.info() == Eigen::Success && factor.diagonal().allFinite();  // Eigen does not detect a NaN
}

void solve_lower(const double* l, std::size_t n, double* x) {
  matrix(l, n, n).triangularView<Eigen::Lower>().solveInPlace(matrix(x, n, 1).col(0));
}

void solve_lower_transposed(const double* l, std::size_t n, double* x) {
  matrix(l, n, n).transpose().triangularView<Eigen::Upper>().solveInPlace(matrix(x, n, 1).col(0));
}

// A third of the work of a general right-hand side: a block of columns begins at its own diagonal.
void invert_lower(const double* l, std::size_t n, double* w) {
  constexpr Index kBlock = 64;
  const ConstMatrix lower = matrix(l, n, n);
  Matrix inverse = matrix(w, n, n);
  inverse.setIdentity();
  for (Index j = 0; j < lower.cols(); j += kBlock) {
    const Index rows = lower.rows() - j;
    lower.bottomRightCorner(rows, rows)
        .triangularView<Eigen::Lower>()
        .solveInPlace(inverse.block(j, j, rows, std::min(kBlock, rows)));
  }
}

}  // namespace prism::kernels
