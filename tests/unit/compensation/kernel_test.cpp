// SPDX-License-Identifier: MIT
// The kernel sum: every path against the slow, obvious one.
#include "compensation/kernel.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace prism::compensation {
namespace {

class OnEveryPath : public testing::TestWithParam<KernelPath> {
 protected:
  void SetUp() override {
    if (!kernel_path_available(GetParam())) GTEST_SKIP() << "this processor has no " << kernel_path_name(GetParam());
    ASSERT_TRUE(use_kernel_path(GetParam()));
  }
  void TearDown() override { (void)use_kernel_path(before_); }

 private:
  KernelPath before_ = kernel_path();
};

INSTANTIATE_TEST_SUITE_P(KernelPaths, OnEveryPath,
                         testing::Values(KernelPath::kScalar, KernelPath::kBaseline, KernelPath::kAvx2,
                                         KernelPath::kAvx512),
                         [](const auto& path) { return kernel_path_name(path.param); });

// 0 to 100 centres, so that every length of a tail occurs; distances from 0 to far beyond where exp underflows.
TEST_P(OnEveryPath, TheSumEqualsTheObviousOne) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-3, 3);
  for (const double sigma2 : {1e-4, 0.01, 1.0, 100.0}) {
    for (Eigen::Index n = 0; n < 100; ++n) {
      const Eigen::Index d = 1 + n % 5;
      const Eigen::MatrixXd points = Eigen::MatrixXd::NullaryExpr(d, n, [&] { return uniform(random); });
      const Eigen::VectorXd alpha = Eigen::VectorXd::NullaryExpr(n, [&] { return uniform(random); });
      const Eigen::VectorXd x = Eigen::VectorXd::NullaryExpr(d, [&] { return uniform(random); });
      const KernelCentres centres(points);
      const std::span<const double> point(x.data(), static_cast<std::size_t>(d));
      long double expected = 0;
      std::vector<double> row(static_cast<std::size_t>(n));
      centres.row(point, sigma2, row.data());
      for (Eigen::Index k = 0; k < n; ++k) {
        const double value = std::exp(-(points.col(k) - x).squaredNorm() / (2 * sigma2));
        ASSERT_NEAR(row[static_cast<std::size_t>(k)], value, kKernelTolerance);
        expected += static_cast<long double>(alpha[k] * value);
      }
      const double found = centres.sum(point, sigma2, centres.padded(alpha));
      ASSERT_NEAR(found, static_cast<double>(expected), kKernelTolerance * (alpha.cwiseAbs().sum() + 1));
    }
  }
}

// The relative error of a single value is what alpha ~ 1e5 amplifies. Arguments that are exact in double, so that exp
// alone errs.
TEST_P(OnEveryPath, ExpErrsByLessThanTwoUnitsInTheLastPlace) {
  double worst = 0;
  for (int i = 0; i <= 20000; ++i) {
    const double distance2 = i * 0.03125;  // exp(0) to exp(−625 / 2)
    const KernelCentres centres(Eigen::MatrixXd::Zero(1, 1));
    double value = 0;
    const double point = std::sqrt(distance2);
    centres.row({&point, 1}, 0.5, &value);
    const long double exact = std::exp(-static_cast<long double>(point * point));
    worst = std::max(worst, static_cast<double>(std::fabs((static_cast<long double>(value) - exact) / exact)));
  }
  EXPECT_LT(worst, 2 * 2.220446049250313e-16);
}

TEST_P(OnEveryPath, FarAwayTheKernelVanishes) {
  const KernelCentres centres(Eigen::MatrixXd::Zero(1, 1));
  double value = 1;
  const double point = 1e10;
  centres.row({&point, 1}, 1e-6, &value);
  EXPECT_GE(value, 0);
  EXPECT_LT(value, 1e-300);
}

TEST(KernelPath, AnUnknownNameIsRefusedInOneLine) {
  const auto path = parse_kernel_path("sse9");
  ASSERT_FALSE(path);
  EXPECT_EQ(path.error().text(), "kernel path: found \"sse9\", expected scalar, baseline, avx2 or avx512");
}

}  // namespace
}  // namespace prism::compensation
