// SPDX-License-Identifier: MIT
// Dense products, factors and solves, and the low-rank primal form, compared with the plain formulas.
#include "compensation/training/dense.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>
#include <vector>

#include "compensation/kernel.hpp"
#include "compensation/training/low_rank.hpp"
#include "compensation/training/lssvm.hpp"

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
  for (const double wrong : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    Eigen::MatrixXd indefinite = Eigen::MatrixXd::Identity(100, 100);
    indefinite(80, 80) = wrong;
    EXPECT_FALSE(cholesky(indefinite)) << wrong;
  }
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

struct Problem {
  Eigen::MatrixXd x;
  Eigen::VectorXd y;
};

Problem noisy_waves(Eigen::Index n) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  Problem p;
  p.x = Eigen::MatrixXd::NullaryExpr(2, n, [&] { return normal(random); });
  p.y = (p.x.row(0).array().sin() + p.x.row(1).array() / 2).matrix().transpose();
  for (double& y : p.y) y += 0.1 * normal(random);
  return p;
}

TEST(LowRank, LeavesAtMostItsStatedRemainderAndACoarseOneIsTheBeginningOfAFineOne) {
  const Problem p = noisy_waves(300);
  const LowRank fine = low_rank(p.x, 1.5, 1e-10, 300);
  for (const double tolerance : {0.5, fine.left_before[20], 1e-2, 1e-6, 1e-9, 1e-10}) {
    const LowRank system = low_rank(p.x, 1.5, tolerance, 300), cut = coarser(fine, tolerance);
    const Eigen::MatrixXd g = system.phi.topRows(system.rank());
    const Eigen::MatrixXd rest = compensation::kernel_matrix(p.x, 1.5) - g.transpose() * g;
    EXPECT_LE(rest.cwiseAbs().maxCoeff(), std::max(tolerance, 1e-13) * 1.01);
    EXPECT_LE(system.left, tolerance);
    EXPECT_LT(system.rank(), 200);
    EXPECT_EQ(cut.pivots, system.pivots);
    EXPECT_EQ(cut.phi, system.phi);
    EXPECT_EQ(cut.left, system.left);
  }
}

TEST(LowRank, ThePrimalFormEqualsTheFullSystemWithinItsTolerance) {
  const Problem p = noisy_waves(200);
  const double c = 30, sigma2 = 1.5;
  Eigen::VectorXd weight = Eigen::VectorXd::LinSpaced(200, 0.2, 1);
  const auto whole = LssvmFactor::make(compensation::kernel_matrix(p.x, sigma2), 1 / (c * weight.array()), p.y);
  ASSERT_TRUE(whole);
  const LowRank system = low_rank(p.x, sigma2, 1e-12, 200);
  PrimalLssvm primal(system, p.y, c);
  ASSERT_TRUE(primal.solve(weight));
  EXPECT_LT((primal.residuals() - whole->solution().alpha.cwiseQuotient(c * weight)).cwiseAbs().maxCoeff(), 1e-7);
  const Eigen::VectorXd loo = primal.residuals().array() / (1 - weight.array() * primal.leverages().array());
  EXPECT_LT((loo - whole->leave_one_out()).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(LowRank, ASampleWithoutWeightIsLeftOut) {
  const Problem p = noisy_waves(100);
  const LowRank system = low_rank(p.x, 1.5, 1e-10, 100);
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(100);
  weight[40] = 0;
  PrimalLssvm primal(system, p.y, 10);
  ASSERT_TRUE(primal.solve(weight));
  const Eigen::VectorXd before = primal.theta();
  Eigen::VectorXd moved = p.y;
  moved[40] += 100;
  PrimalLssvm again(system, moved, 10);
  ASSERT_TRUE(again.solve(weight));
  EXPECT_LT((again.theta() - before).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(LowRank, LongRecordsTakeTheirPivotsFromASample) {
  const Problem p = noisy_waves(kPivotSample + 500);
  const LowRank system = low_rank(p.x, 2, 1e-4, 300);
  EXPECT_EQ(system.phi.cols(), p.x.cols());
  EXPECT_LT(system.left, 0.05);
  // φ of a pivot reproduces K there: φ_i · φ_j = k(x_i, x_j) for pivots i, j.
  const Eigen::Index i = system.pivots[0], j = system.pivots[5];
  const double k = std::exp(-(p.x.col(i) - p.x.col(j)).squaredNorm() / 4);
  const Eigen::Index r = system.rank();
  EXPECT_NEAR(system.phi.col(i).head(r).dot(system.phi.col(j).head(r)), k, 1e-9);
}

}  // namespace
}  // namespace prism::training
