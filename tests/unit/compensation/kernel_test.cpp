// SPDX-License-Identifier: MIT
// The kernel, compared with a simple reference, and bit by bit with the result of all machines.
#include "compensation/kernel.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace prism::compensation {
namespace {

std::span<const double> whole(const Eigen::VectorXd& x) { return {x.data(), static_cast<std::size_t>(x.size())}; }

// 0 to 100 centres, so that every length of the last chunk occurs; distances from 0 to where exp underflows.
TEST(Kernel, TheSumEqualsASimpleReference) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-3, 3);
  for (const double sigma2 : {1e-4, 0.01, 1.0, 100.0}) {
    for (Eigen::Index n = 0; n < 100; ++n) {
      const Eigen::Index d = 1 + n % 5;
      const Eigen::MatrixXd points = Eigen::MatrixXd::NullaryExpr(d, n, [&] { return uniform(random); });
      const Eigen::VectorXd alpha = Eigen::VectorXd::NullaryExpr(n, [&] { return uniform(random); });
      const Eigen::VectorXd x = Eigen::VectorXd::NullaryExpr(d, [&] { return uniform(random); });
      const KernelCentres centres(points, {sigma2});
      long double expected = 0;
      Eigen::VectorXd row(n);
      centres.row(whole(x), row.data());
      for (Eigen::Index k = 0; k < n; ++k) {
        const double value = std::exp(-(points.col(k) - x).squaredNorm() / (2 * sigma2));
        ASSERT_NEAR(row[k], value, kKernelTolerance);
        expected += static_cast<long double>(alpha[k] * value);
      }
      const double found = centres.sum(whole(x), alpha);
      ASSERT_NEAR(found, static_cast<double>(expected), kKernelTolerance * (alpha.cwiseAbs().sum() + 1));
    }
  }
}

// Sums longer than a chunk of the inner loop, with every length of the last one.
TEST(Kernel, ALongSumEqualsTheSumOfItsRow) {
  std::mt19937_64 random(12);
  std::normal_distribution<double> normal;
  for (const Eigen::Index n : {255, 256, 257, 512, 924, 1000}) {
    const Eigen::MatrixXd points = Eigen::MatrixXd::NullaryExpr(3, n, [&] { return normal(random); });
    const Eigen::VectorXd alpha = Eigen::VectorXd::NullaryExpr(n, [&] { return normal(random); });
    const Eigen::VectorXd x = Eigen::Vector3d(0.1, 0.2, 0.3);
    const KernelCentres centres(points, {0.7});
    Eigen::VectorXd row(n);
    centres.row(whole(x), row.data());
    EXPECT_NEAR(centres.sum(whole(x), alpha), row.dot(alpha), 1e-14 * alpha.cwiseAbs().sum()) << n;
  }
}

TEST(Kernel, TheMatrixContainsTheRowsOfItsPoints) {
  std::mt19937_64 random(13);
  std::normal_distribution<double> normal;
  for (const Eigen::Index n : {1, 31, 32, 33, 100}) {
    const Eigen::MatrixXd points = Eigen::MatrixXd::NullaryExpr(2, n, [&] { return normal(random); });
    const Eigen::MatrixXd k = kernel_matrix(points, {0.3});
    Eigen::VectorXd row(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      KernelCentres(points, {0.3}).row(whole(points.col(j)), row.data());
      ASSERT_EQ((k.col(j) - row).cwiseAbs().maxCoeff(), 0) << n << ' ' << j;
      ASSERT_EQ(k(j, j), 1);
    }
    ASSERT_EQ((k - k.transpose()).cwiseAbs().maxCoeff(), 0) << n;
  }
}

// alpha ~ 1e5 amplifies the relative error of a single value. The arguments are exact in double, so that the error is
// that of exp alone.
TEST(Kernel, TheErrorOfExpIsBelowTwoUnitsInTheLastPlace) {
  double worst = 0;
  const KernelCentres centres(Eigen::MatrixXd::Zero(1, 1), {0.5});
  for (int i = 0; i <= 20000; ++i) {
    const double distance2 = i * 0.03125;  // exp(0) to exp(−625)
    double value = 0;
    const double point = std::sqrt(distance2);
    centres.row({&point, 1}, &value);
    const long double exact = std::exp(-static_cast<long double>(point * point));
    worst = std::max(worst, static_cast<double>(std::fabs((static_cast<long double>(value) - exact) / exact)));
  }
  EXPECT_LT(worst, 2 * 2.220446049250313e-16);
}

TEST(Kernel, TheKernelVanishesAtLargeDistance) {
  const KernelCentres centres(Eigen::MatrixXd::Zero(1, 1), {1e-6});
  double value = 1;
  const double point = 1e10;
  centres.row({&point, 1}, &value);
  EXPECT_GE(value, 0);
  EXPECT_LT(value, 1e-300);
}

// A capture has the same log on every machine, because the kernel returns the same bits on any processor, at any
// microarchitecture level, in any build. The number is from GCC 12 for x86-64 and valid for all.
TEST(Kernel, EveryMachineReturnsTheSameBits) {
  std::mt19937_64 random(14);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };  // exact, unlike a library's
  std::uint64_t hash = 14695981039346656037u;                                              // FNV-1a
  const auto add = [&](double value) { hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211u; };
  for (const double sigma2 : {0.001, 0.1, 1.0, 30.0}) {
    for (const Eigen::Index n : {1, 7, 16, 100, 300, 924}) {
      const Eigen::MatrixXd points = Eigen::MatrixXd::NullaryExpr(3, n, uniform);
      const Eigen::VectorXd alpha = Eigen::VectorXd::NullaryExpr(n, uniform);
      const Eigen::VectorXd x = Eigen::VectorXd::NullaryExpr(3, uniform);
      const KernelCentres centres(points, {sigma2});
      Eigen::VectorXd row(n);
      centres.row(whole(x), row.data());
      for (const double value : row) add(value);
      add(centres.sum(whole(x), alpha));
    }
  }
  EXPECT_EQ(hash, 2914494778659022731u);
}

}  // namespace
}  // namespace prism::compensation
