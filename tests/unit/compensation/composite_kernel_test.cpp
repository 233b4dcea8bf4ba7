// SPDX-License-Identifier: MIT
// The composite kernel: every way to compute it gives its formula.
#include <gtest/gtest.h>

#include <cmath>

#include "compensation/kernel.hpp"

namespace prism::compensation {
namespace {

TEST(CompositeKernel, IsItsFormulaInTheMatrixARowASumAndTheVariance) {
  const CompositeKernel kernel{.rbf = 1.3, .length2 = Eigen::Vector2d(0.7, 2.9), .linear = 0.4, .quadratic = 0.06};
  Eigen::MatrixXd points(2, 4);
  points << -1.1, 0.2, 0.9, 1.7, 0.5, -0.8, 1.4, -0.3;
  Eigen::MatrixXd expected(4, 4);
  for (Eigen::Index i = 0; i < 4; ++i) {
    for (Eigen::Index j = 0; j < 4; ++j) {
      const Eigen::Vector2d x = points.col(i), y = points.col(j);
      const double dot = x.dot(y), d0 = x[0] - y[0], d1 = x[1] - y[1];
      expected(i, j) = 1.3 * std::exp(-d0 * d0 / (2 * 0.7) - d1 * d1 / (2 * 2.9)) + 0.4 * dot + 0.06 * dot * dot;
    }
  }
  EXPECT_LT((kernel.matrix(points) - expected).cwiseAbs().maxCoeff(), 1e-14);
  CompositeCentres centres(kernel, points);
  const Eigen::Vector4d alpha(0.3, -1.2, 0.8, 2.1);
  centres.weigh(alpha);
  for (Eigen::Index i = 0; i < 4; ++i) {
    const Eigen::VectorXd x = points.col(i);
    EXPECT_LT((centres.row(x) - expected.col(i)).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_NEAR(centres.sum(x), expected.col(i).dot(alpha), 1e-13);
    EXPECT_NEAR(kernel.variance(x), expected(i, i), 1e-14);
  }
}

}  // namespace
}  // namespace prism::compensation
