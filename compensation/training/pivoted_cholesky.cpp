// SPDX-License-Identifier: MIT
#include "compensation/training/pivoted_cholesky.hpp"

#include <algorithm>
#include <cmath>

namespace prism::training {

PivotedCholesky pivoted_cholesky(Eigen::VectorXd diagonal, const KernelRow& row, double tolerance,
                                 Eigen::Index max_rank) {
  const Eigen::Index n = diagonal.size();
  PivotedCholesky p;
  p.features.resize(std::min<Eigen::Index>(64, max_rank + 1), n);
  Eigen::VectorXd k(n);
  while (p.rank() < max_rank) {
    Eigen::Index next = 0;
    p.left = diagonal.maxCoeff(&next);
    if (!(p.left > tolerance)) break;
    const Eigen::Index r = p.rank();
    if (r + 1 >= p.features.rows()) p.features.conservativeResize(std::min(2 * p.features.rows(), max_rank + 1), n);
    row(next, k);
    const Eigen::VectorXd own = p.features.col(next).head(r);
    const double root = std::sqrt(p.left);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double value = (k[i] - p.features.col(i).head(r).dot(own)) / root;
      p.features(r, i) = value;
      diagonal[i] -= value * value;
    }
    diagonal[next] = 0;
    p.pivots.push_back(next);
    p.left_before.push_back(p.left);
  }
  p.left = diagonal.maxCoeff();
  return p;
}

}  // namespace prism::training
