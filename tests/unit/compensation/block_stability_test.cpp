// SPDX-License-Identifier: MIT
// Bias stability over blocks, compared with a two-pass computation on the grid of the windows.
#include "compensation/block_stability.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace prism::compensation {
namespace {

constexpr double kSumRounding = 1e-12;

CompensatedWindow row_at(std::int64_t second, double rate_deg_per_h, double corrected_deg_per_h,
                         WindowState state = WindowState::kReady) {
  CompensatedWindow row;
  row.window.second_mean.second = second;
  row.window.state = state;
  row.window.rate_deg_per_h = rate_deg_per_h;
  row.corrected_mean_deg_per_h = corrected_deg_per_h;
  return row;
}

double plain_mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double plain_sd(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += (value - plain_mean(values)) * (value - plain_mean(values));
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

TEST(RunningVariance, KeepsPrecisionWithALargeOffsetAndHasNoDeviationBelowTwoValues) {
  RunningVariance running, few;
  for (int i = 0; i < 1'000'000; ++i) running.add(1e9 + (i % 2));  // sums of squares would lose the 0.5
  EXPECT_NEAR(running.sd(), 0.5, 1e-6);
  EXPECT_TRUE(std::isnan(few.mean()));
  few.add(3);
  EXPECT_EQ(few.mean(), 3);
  EXPECT_TRUE(std::isnan(few.sd()));
  few.add(5);
  EXPECT_NEAR(few.sd(), std::sqrt(2.0), kSumRounding);  // divisor N − 1
}

struct BlockStabilityTest : testing::Test {
  BlockStability stability;
};

TEST_F(BlockStabilityTest, UsesEveryHundredthWindowOnly) {
  std::vector<double> raw, corrected;
  std::mt19937_64 random(37);
  std::normal_distribution<double> normal(0, 0.02);
  for (int s = 0; s < 10'000; ++s) {
    const bool ready = s >= 109;
    const double rate = 8 + normal(random), rest = 8 + 0.4 * normal(random);
    stability.add(row_at(s, rate, ready ? rest : kUnknown, ready ? WindowState::kReady : WindowState::kWarming), 100);
    if (ready && (s - 109) % 100 == 0) raw.push_back(rate), corrected.push_back(rest);
  }
  EXPECT_EQ(stability.raw().count(), 99);
  EXPECT_NEAR(stability.raw().sd(), plain_sd(raw), kSumRounding);
  EXPECT_NEAR(stability.corrected().sd(), plain_sd(corrected), kSumRounding);
  EXPECT_NEAR(stability.all().sd(), plain_sd(raw), kSumRounding);
  EXPECT_NEAR(stability.improvement().value(), 1 - plain_sd(corrected) / plain_sd(raw), kSumRounding);
}

// A gap, a clock that was set back, and a missing second at the end of a block: no block overlaps another.
TEST_F(BlockStabilityTest, TheGridRestartsAfterAGap) {
  const auto seconds = [&](int from, int to, WindowState state = WindowState::kReady) {
    for (int s = from; s <= to; ++s) stability.add(row_at(s, s, s, state), 100);
  };
  const auto expect = [&](std::vector<double> ends) {
    EXPECT_EQ(stability.all().count(), static_cast<std::int64_t>(ends.size()));
    EXPECT_NEAR(stability.all().mean(), plain_mean(ends), 1e-9);
    stability.reset();
    EXPECT_EQ(stability.all().count(), 0);
  };
  seconds(0, 250);
  seconds(260, 299, WindowState::kWarming);
  seconds(370, 470);
  expect({0, 100, 200, 370, 470});
  seconds(10'000, 10'100);
  seconds(0, 0, WindowState::kWarming);
  seconds(109, 209);
  expect({10'000, 10'100, 109, 209});
  seconds(0, 99);
  seconds(102, 205);
  expect({0, 102, 202});
  stability.add(row_at(0, kUnknown, kUnknown), 100);  // without a rate: left out
  seconds(50, 50);
  EXPECT_EQ(stability.all().count(), 0);
}

TEST_F(BlockStabilityTest, ComparesRawAndCorrectedOverTheSameBlocks) {
  for (int block = 0; block < 10; ++block) {  // the first five blocks have no correction and a large rate
    stability.add(row_at(100 * block, block < 5 ? 1000 * block : block % 2, block < 5 ? kUnknown : 0.1 * (block % 2)),
                  100);
  }
  EXPECT_EQ(stability.all().count(), 10);
  EXPECT_EQ(stability.raw().count(), 5);
  EXPECT_EQ(stability.corrected().count(), 5);
  EXPECT_NEAR(stability.improvement().value(), 0.9, kSumRounding);
}

TEST_F(BlockStabilityTest, AConstantRateHasNoImprovementAndAWorseCorrectionANegativeOne) {
  EXPECT_FALSE(stability.improvement());
  stability.add(row_at(0, 8, 8), 100);
  EXPECT_FALSE(stability.improvement());
  stability.add(row_at(100, 8, 8.1), 100);
  EXPECT_FALSE(stability.improvement());  // raw is constant
  stability.reset();
  for (int block = 0; block < 4; ++block) stability.add(row_at(10 + 100 * block, block % 2, 3 * (block % 2)), 100);
  EXPECT_NEAR(stability.improvement().value(), -2, kSumRounding);
}

}  // namespace
}  // namespace prism::compensation
