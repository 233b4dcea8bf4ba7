// SPDX-License-Identifier: MIT
// Folds and held-out errors by hand: the stated error of a model in a new run.
#include "compensation/training/held_out.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "compensation/training/robust.hpp"

namespace prism::training {
namespace {

// std::mt19937_64 written again in Python gave these.
TEST(HeldOut, ShuffledFoldsAreThoseOfTheGenerator) {
  EXPECT_EQ(shuffled_folds(11, 3, 1), (Folds{2, 1, 2, 1, 0, 1, 2, 0, 0, 2, 2}));
  EXPECT_EQ(shuffled_folds(4, 9, 2), (Folds{3, 1, 0, 2})) << "at most one per sample";
  EXPECT_EQ(shuffled_folds(5, 0, 3), (Folds{0, 0, 0, 0, 0}));
}

TEST(HeldOut, RowsAreThinnedToAtMostTheirNumber) {
  EXPECT_EQ(thinned(10, 10).size(), 10u);
  EXPECT_EQ(thinned(11, 10), (Rows{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(thinned(7, 3), (Rows{0, 3, 6}));
  EXPECT_EQ(thinned(0, 3), Rows());
  EXPECT_EQ(others({1, 3}, 5), (Rows{0, 2, 4}));
  EXPECT_EQ(taken({5, 6, 7, 8}, {0, 3}), (std::vector{5, 8}));
  EXPECT_EQ(numbered({9, 2, 9, 4}), (std::vector{2, 0, 2, 1}));
  EXPECT_EQ(fold_count({}), 0);
  EXPECT_EQ(fold_count({0, 2}), 3);
  EXPECT_EQ(folds_from({1, 1.5}).error().text(), "fold column: found 1.5, expected integers");
  EXPECT_EQ(folds_from({4, 4}).error().text(), "fold column: found 1 folds, expected at least 2");
}

// 40 rows are the fewest; ten blocks, or the recordings if there are three.
TEST(HeldOut, FoldsOfAShortRecordAreNone) {
  EXPECT_TRUE(held_out_folds(std::vector<int>(39, 0)).empty());
  const Folds ten = held_out_folds(std::vector<int>(40, 0));
  for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(ten[i], static_cast<int>(i / 4)) << i;
  EXPECT_TRUE(held_out({0, 1, 1}, [](const Rows&, const Rows& members) {
                return members.size() == 1 ? Eigen::VectorXd(Eigen::VectorXd::Ones(1)) : Eigen::VectorXd();
              }).size() == 0);
  EXPECT_EQ(mean_of_folds(Eigen::Vector4d(-1, 2, 4, -9), {0, 1, 1, 1}), 3) << "of the means 1 and 5";
  const HeldOutErrors held =
      held_out_errors(thinned(82, 41), std::vector<int>(82, 0), 2, [](const Rows& rest, const Rows& members) {
        EXPECT_EQ(rest.size() + members.size(), 41u);
        return Eigen::VectorXd::Constant(std::ssize(members), static_cast<double>(members[0])).eval();
      });
  ASSERT_EQ(held.error.size(), 41);
  EXPECT_EQ(held.samples, thinned(82, 41));
  EXPECT_EQ(held.folds, held_out_folds(std::vector<int>(41, 0)));
  EXPECT_EQ(held.error[40], 2.0 * static_cast<double>(fold_members(held.folds)[9][0]));
  EXPECT_EQ(held.model_variance, Eigen::VectorXd::Zero(41));
  EXPECT_EQ(held_out_errors(thinned(20, 20), std::vector<int>(20, 0), 1, {}).error.size(), 0);
}

TEST(HeldOut, AQuantileIsTheValueAtItsIndex) {
  std::vector<double> values;
  for (int i = 100; i >= 0; --i) values.push_back(i);
  EXPECT_EQ(order_statistic(values, 0.95), 95);
  EXPECT_EQ(order_statistic(values, 0), 0);
  EXPECT_EQ(order_statistic(values, 1), 100);
  EXPECT_EQ(order_statistic({3, 1, 2, 4}, 0.5), 2) << "of index 1.5";
  EXPECT_EQ(guard_of(values, 7), 12 * 99);
  EXPECT_EQ(guard_of({}, 7), 7);
}

/// Errors of 1 to 21 in turn; of the 21 values the 95 % quantile is 20. The residuals step by 3: a noise of 1.483 · 3 /
/// √2.
struct Spread : testing::Test {
  Spread() {
    held.error.resize(42), residual.resize(42);
    for (Eigen::Index i = 0; i < 42; ++i) {
      const Eigen::Index size = 1 + i / 2;
      held.error[i] = (i % 2 ? -1 : 1) * static_cast<double>(size);
      held.folds.push_back(static_cast<int>(i / 21));
      residual[i] = i % 2 ? 3 : 0;
    }
    held.model_variance = Eigen::VectorXd::Zero(42);
  }
  std::optional<compensation::BetweenRunError> found(std::vector<int> recordings = std::vector<int>(42, 0)) const {
    return between_run_error_of(held, residual, 10, recordings);
  }
  HeldOutErrors held;
  Eigen::VectorXd residual;
  const double noise = 1.483 * 3 / std::sqrt(2.0);
};

// 20 is 2 sd_mean: 1.25 nuisance² + 1² + noise² = 10².
TEST_F(Spread, TheNuisanceExplains95PercentOfTheErrors) {
  const auto spread = found();
  ASSERT_TRUE(spread);
  EXPECT_DOUBLE_EQ(spread->noise_deg_per_h, noise);
  EXPECT_EQ(spread->offset_deg_per_h, 1) << "a tenth of the target's sd";
  EXPECT_EQ(spread->factor, 1);
  EXPECT_EQ(spread->blocks, 2);
  EXPECT_EQ(spread->samples, 42);
  const double expected = std::sqrt((100 - 1 - noise * noise) / 1.25);
  EXPECT_GE(spread->nuisance_deg_per_h, expected * (1 - 1e-12));
  EXPECT_LE(spread->nuisance_deg_per_h, expected * (1 + 2e-6));
  std::vector<int> two(42, 0);
  two.back() = 1;
  EXPECT_EQ(found(two)->offset_deg_per_h, 0);
  EXPECT_NEAR(found(two)->nuisance_deg_per_h, std::sqrt((100 - noise * noise) / 1.25), 2e-5);
  held.model_variance.setConstant(4);
  EXPECT_NEAR(found()->nuisance_deg_per_h, std::sqrt((100 - 1 - noise * noise) / 1.25 - 4), 2e-5);
}

TEST_F(Spread, ErrorsThatTheNoiseExplainsNeedNoNuisance) {
  held.error *= 2 * std::hypot(1, noise) / 20;
  EXPECT_EQ(found()->nuisance_deg_per_h, 0) << "exactly 2";
  held.error *= 1.001;
  EXPECT_GT(found()->nuisance_deg_per_h, 0);
}

TEST_F(Spread, WithoutFoldsOrWithErrorsThatAreNotFiniteThereIsNone) {
  held.folds.assign(42, 0);
  EXPECT_FALSE(found());
  held.folds[7] = 1;
  EXPECT_TRUE(found());
  held.model_variance[3] = std::nan("");
  EXPECT_FALSE(found());
  held.model_variance[3] = 0;
  held.error[3] = HUGE_VAL;
  EXPECT_FALSE(found());
}

// Every third window of an hour: 110 errors that do not correlate.
TEST(MonitorOf, TakesTheStepOfItsSamples) {
  HeldOutErrors held;
  held.error.resize(110);
  Eigen::VectorXd time_s(330);
  for (Eigen::Index i = 0; i < 330; ++i) time_s[i] = 3600.0 * static_cast<double>(i);
  for (Eigen::Index i = 0; i < 110; ++i)
    held.error[i] = std::sin(static_cast<double>(i * i)), held.samples.push_back(3 * i);
  const compensation::BetweenRunError spread{0, 0.75, 0, 2, 0, 0};
  const auto found = monitor_of(held, spread, std::vector<int>(330, 0), time_s, 3600);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->every, 3);
  EXPECT_EQ(found->offset_deg_per_h, 1.5) << "the factor times the offset";
  const double mean = held.error.mean();
  EXPECT_NEAR(found->sd_deg_per_h, std::sqrt((held.error.array() - mean).square().mean()), 1e-12);
  EXPECT_EQ(monitor_of(held, spread, std::vector<int>(330, 0), time_s / 9, 3600)->every, 1) << "at least";
  held.error[3] = HUGE_VAL;
  EXPECT_FALSE(monitor_of(held, spread, std::vector<int>(330, 0), time_s, 3600));
  held.error.resize(1);
  held.error[0] = 1;
  EXPECT_FALSE(monitor_of(held, spread, std::vector<int>(330, 0), time_s, 3600));
}

}  // namespace
}  // namespace prism::training
