// SPDX-License-Identifier: MIT
// Pivoted Cholesky of a kernel matrix: K ≈ G Gᵀ from the rows of a few pivots.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace prism::training {

struct PivotedCholesky {
  std::vector<Eigen::Index> pivots;  ///< in the order in which they were added
  std::vector<double> left_before;   ///< largest diagonal entry of K − G Gᵀ before each pivot
  Eigen::MatrixXd features;          ///< Gᵀ in the first pivots.size() rows; N columns
  double left = 0;                   ///< largest diagonal entry of K − G Gᵀ

  Eigen::Index rank() const { return static_cast<Eigen::Index>(pivots.size()); }
};

/// Writes row i of K into `k`, N numbers.
using KernelRow = std::function<void(Eigen::Index i, Eigen::VectorXd& k)>;

/// Adds pivots, largest diagonal entry first, until it is at most `tolerance` or there are `max_rank`. `diagonal`: of
/// K. O(N r²).
PivotedCholesky pivoted_cholesky(Eigen::VectorXd diagonal, const KernelRow& row, double tolerance,
                                 Eigen::Index max_rank);

}  // namespace prism::training
