// SPDX-License-Identifier: MIT
// Products, factors and solves of every path against Eigen's own.
#include "compensation/dense.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "compensation/kernel.hpp"

namespace prism::compensation {
namespace {

class DenseOnEveryPath : public testing::TestWithParam<KernelPath> {
 protected:
  void SetUp() override {
    if (!kernel_path_available(GetParam())) GTEST_SKIP() << "this processor has no " << kernel_path_name(GetParam());
    ASSERT_TRUE(use_kernel_path(GetParam()));
  }
  void TearDown() override { (void)use_kernel_path(before_); }
  Eigen::MatrixXd noise(Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal_(random_); });
  }

 private:
  std::mt19937_64 random_{5};
  std::normal_distribution<double> normal_;
  KernelPath before_ = kernel_path();
};

INSTANTIATE_TEST_SUITE_P(KernelPaths, DenseOnEveryPath,
                         testing::Values(KernelPath::kBaseline, KernelPath::kAvx2, KernelPath::kAvx512),
                         [](const auto& path) { return kernel_path_name(path.param); });

TEST_P(DenseOnEveryPath, GramsOfAllShapesAreRight) {
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

TEST_P(DenseOnEveryPath, FactorsSolvesAndInversesUndoTheMatrix) {
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

TEST_P(DenseOnEveryPath, AMatrixThatIsNotPositiveDefiniteIsToldApart) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(100, 100);
  a(80, 80) = -1;
  EXPECT_FALSE(cholesky(a));
  Eigen::MatrixXd b = Eigen::MatrixXd::Identity(3, 3);
  b(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(cholesky(b));
}

}  // namespace
}  // namespace prism::compensation
