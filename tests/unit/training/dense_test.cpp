// SPDX-License-Identifier: MIT
// Products, factors and solves of libprism-kernels, compared with the plain formulas.
#include "compensation/training/dense.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>
#include <vector>

namespace prism::training {
namespace {

class Dense : public testing::Test {
 protected:
  Eigen::MatrixXd noise(Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal_(random_); });
  }

 private:
  std::mt19937_64 random_{5};
  std::normal_distribution<double> normal_;
};

TEST_F(Dense, ComputesGramMatricesOfAllShapes) {
  for (const Eigen::Index n : {1, 3, 8, 23, 24, 25, 70}) {
    for (const Eigen::Index k : {0, 1, 5, 191, 192, 400}) {
      const Eigen::MatrixXd a = noise(n, k);
      const Eigen::VectorXd w = noise(k, 1).cwiseAbs();
      Eigen::MatrixXd c = noise(n, n);
      const Eigen::MatrixXd before = c;
      const Eigen::MatrixXd expected = before - a * w.asDiagonal() * a.transpose();
      add_gram(a, c, &w, -1);
      for (Eigen::Index j = 0; j < n; ++j) {
        for (Eigen::Index i = 0; i < n; ++i) {
          ASSERT_NEAR(c(i, j), i >= j ? expected(i, j) : before(i, j), 1e-12 * static_cast<double>(k + 1))
              << n << ' ' << k;
        }
      }
    }
  }
}

TEST_F(Dense, FactorsSolvesAndInversesInvertTheMatrix) {
  for (const Eigen::Index n : {1, 2, 7, 31, 64, 65, 100, 129, 257}) {
    const Eigen::MatrixXd a = noise(n, n);
    const Eigen::MatrixXd spd = a * a.transpose() + Eigen::MatrixXd::Identity(n, n);
    Eigen::MatrixXd l = spd;
    ASSERT_TRUE(cholesky(l));
    const Eigen::MatrixXd lower = l.triangularView<Eigen::Lower>();
    ASSERT_LT((lower * lower.transpose() - spd).norm() / spd.norm(), 1e-14) << n;
    const Eigen::VectorXd truth = noise(n, 1);
    Eigen::VectorXd x = spd * truth;
    solve_cholesky(l, x);
    ASSERT_LT((x - truth).norm() / truth.norm(), 1e-8) << n;
    ASSERT_LT((inverse_lower(l) * lower - Eigen::MatrixXd::Identity(n, n)).norm(), 1e-9) << n;
  }
}

TEST_F(Dense, DetectsAMatrixThatIsNotPositiveDefinite) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(100, 100);
  a(80, 80) = -1;
  EXPECT_FALSE(cholesky(a));
  Eigen::MatrixXd b = Eigen::MatrixXd::Identity(3, 3);
  b(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(cholesky(b));
}

// Vectorised sums may start at an aligned address; a result would then depend on the position in the heap.
TEST_F(Dense, ResultsDoNotDependOnTheAddressOfAMatrix) {
  constexpr std::size_t kSize = 129, kValues = kSize * kSize;
  const Eigen::MatrixXd a = noise(kSize, kSize), y = noise(kSize, 1);
  const Eigen::MatrixXd spd = a * a.transpose() + Eigen::MatrixXd::Identity(kSize, kSize);
  std::vector<double> memory(4 * kValues), expected;
  for (std::size_t shift = 0; shift < 8; ++shift) {
    double* const l = memory.data() + shift;
    double* const c = l + kValues;
    double* const x = c + kValues;
    std::copy(spd.data(), spd.data() + kValues, l);
    std::copy(spd.data(), spd.data() + kValues, c);
    std::copy(y.data(), y.data() + kSize, x);
    ASSERT_TRUE(kernels::cholesky(l, kSize));
    kernels::solve_lower(l, kSize, x);
    kernels::solve_lower_transposed(l, kSize, x);
    kernels::add_gram(l, kSize, kSize, x, 1, c);
    kernels::invert_lower(l, kSize, x + kSize);
    const std::vector<double> found(l, x + kSize + kValues);
    if (shift == 0) expected = found;
    ASSERT_EQ(found, expected) << shift;
  }
}

}  // namespace
}  // namespace prism::training
