// SPDX-License-Identifier: MIT
// Divisor, compensated sums and medians, compared with hand calculations.
#include "compensation/evaluation/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace prism::evaluation {
namespace {

TEST(SummaryStatistics, NamesAndUsesBothDivisors) {
  const std::vector<double> values = {2, 4, 4, 4, 5, 5, 7, 9};  // mean 5, sum of squared deviations 32
  const SummaryStatistics n = summarise(values, Divisor::kN, "x").value();
  EXPECT_DOUBLE_EQ(n.sd, 2.0);
  EXPECT_DOUBLE_EQ(summarise(values, Divisor::kNMinus1, "x")->sd, std::sqrt(32.0 / 7.0));
  EXPECT_DOUBLE_EQ(n.mean, 5);
  EXPECT_DOUBLE_EQ(n.rms, std::sqrt(232.0 / 8.0));
  EXPECT_DOUBLE_EQ(n.peak_to_peak, 7);
  EXPECT_STREQ(divisor_text(Divisor::kN), "N");
  EXPECT_STREQ(divisor_text(Divisor::kNMinus1), "N-1");
}

TEST(SummaryStatistics, KeepsPrecisionWithALargeOffset) {
  // The one-pass formula Σx² − N m² gives 0 or noise here.
  const std::vector<double> values = {1e9 + 1, 1e9 + 2, 1e9 + 3};
  EXPECT_NEAR(summarise(values, Divisor::kNMinus1, "x")->sd, 1.0, 1e-12);
}

TEST(SummaryStatistics, OfAConstantIsExactlyZero) {
  const std::vector<double> values(1000, 0.1);
  EXPECT_EQ(summarise(values, Divisor::kN, "x")->sd, 0);
}

TEST(SummaryStatistics, RejectsSeriesWithoutADeviation) {
  EXPECT_EQ(summarise({}, Divisor::kN, "rate").error().text(),
            "rate: a standard deviation needs 2 values or more, found 0");
  const std::vector<double> one = {1};
  EXPECT_FALSE(summarise(one, Divisor::kN, "rate"));
  const std::vector<double> with_nan = {1, 2, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_EQ(summarise(with_nan, Divisor::kN, "rate").error().text(), "rate: value 2 is not a finite number");
}

TEST(CarefulSum, IsMorePreciseThanAPlainSum) {
  const std::vector<double> values = {1, 1e100, 1, -1e100};
  EXPECT_EQ(neumaier_sum(values), 2);
}

TEST(Median, ReturnsTheMiddleOrTheMeanOfTwo) {
  EXPECT_EQ(median_of({3, 1, 2}), 2);
  EXPECT_EQ(median_of({4, 1, 3, 2}), 2.5);
}

TEST(RobustSd, IgnoresOutliers) { EXPECT_NEAR(robust_sd({-2, -1, 0, 1, 2, 1e6}), 1.4826 * 1.5, 1e-12); }

}  // namespace
}  // namespace prism::evaluation
