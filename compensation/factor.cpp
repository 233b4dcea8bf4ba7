// SPDX-License-Identifier: MIT
#include "compensation/factor.hpp"

#include <Eigen/Cholesky>

namespace prism::compensation {
namespace {

// Eigen chooses its block sizes by the caches, which changes a factor's last bits. This fixes them before first use.
[[maybe_unused]] const bool kSameCachesEverywhere = [] {
  Eigen::setCpuCacheSizes(32 << 10, 256 << 10, 2 << 20);
  return true;
}();

}  // namespace

bool lower_factor(Eigen::MatrixXd& matrix) {
  Eigen::Ref<Eigen::MatrixXd> in_place(matrix);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(in_place);
  return llt.info() == Eigen::Success && matrix.diagonal().allFinite();
}

void solve_factor(const Eigen::MatrixXd& factor, Eigen::VectorXd& x) {
  factor.triangularView<Eigen::Lower>().solveInPlace(x);
}

void solve_factored(const Eigen::MatrixXd& factor, Eigen::VectorXd& x) {
  solve_factor(factor, x);
  factor.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
}

}  // namespace prism::compensation
