// SPDX-License-Identifier: MIT
#include "compensation/kernel.hpp"

#include <algorithm>
#include <cassert>

#include "compensation/kernels/kernels.hpp"

namespace prism::compensation {
namespace {

kernels::Points from(const Eigen::MatrixXd& inputs, Eigen::Index first) {
  const auto rows = static_cast<std::size_t>(inputs.rows()), columns = static_cast<std::size_t>(inputs.cols());
  return {inputs.data() + first, rows, columns, rows - static_cast<std::size_t>(first)};
}

double gamma(const Kernel& kernel) { return 0.5 / kernel.sigma2; }

}  // namespace

KernelCentres::KernelCentres(const Eigen::MatrixXd& centres, const Kernel& kernel)
    : kernel_(kernel), inputs_(centres.transpose()) {}

double KernelCentres::sum(std::span<const double> point, const Eigen::VectorXd& alpha) const {
  assert(std::ssize(point) == inputs_.cols() && alpha.size() == inputs_.rows());
  return kernels::rbf_sum(from(inputs_, 0), point.data(), gamma(kernel_), alpha.data());
}

void KernelCentres::row(std::span<const double> point, double* row, Eigen::Index first) const {
  assert(std::ssize(point) == inputs_.cols() && first <= inputs_.rows());
  kernels::rbf_row(from(inputs_, first), point.data(), gamma(kernel_), row);
}

// In blocks, so that both sides of the mirrored copy stay in the cache; a column is computed from its own block down.
Eigen::MatrixXd kernel_matrix(const Eigen::MatrixXd& points, const Kernel& kernel) {
  constexpr Eigen::Index kBlock = 32;
  const Eigen::Index n = points.cols(), d = points.rows();
  const KernelCentres centres(points, kernel);
  Eigen::MatrixXd k(n, n);
  for (Eigen::Index first = 0; first < n; first += kBlock) {
    const Eigen::Index end = std::min(first + kBlock, n);
    for (Eigen::Index j = first; j < end; ++j)
      centres.row({points.col(j).data(), static_cast<std::size_t>(d)}, k.col(j).data() + first, first);
    for (Eigen::Index i = end; i < n; i += kBlock) {
      const Eigen::Index rows = std::min(kBlock, n - i);
      k.block(first, i, end - first, rows) = k.block(i, first, rows, end - first).transpose();
    }
  }
  return k;
}

}  // namespace prism::compensation
