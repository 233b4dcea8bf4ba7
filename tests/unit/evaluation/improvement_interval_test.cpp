// SPDX-License-Identifier: MIT
// Series with a known improvement, simulated repeatedly.
#include "compensation/evaluation/improvement_interval.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "compensation/evaluation/bias_stability.hpp"

namespace prism::evaluation {
namespace {

/// A first-order autoregression with a standard deviation of `sd`.
std::vector<double> coloured(std::size_t n, double memory, double sd, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<double> series(n);
  double value = normal(random);
  for (double& sample : series) {
    value = memory * value + std::sqrt(1 - memory * memory) * normal(random);
    sample = sd * value;
  }
  return series;
}

struct Day {
  std::vector<double> before, after;
};

/// Bias of a profile, with another strength each day, and the residual of a model.
Day day(std::mt19937_64& random, double memory) {
  Day made{{}, coloured(924, memory, 0.007, random)};
  const double strength = std::exp(kBetweenDays * std::normal_distribution<double>()(random));
  for (std::size_t i = 0; i < 924; ++i)
    made.before.push_back(0.02 * strength * std::sin(static_cast<double>(i) / 73) + made.after[i]);
  return made;
}

TEST(ImprovementInterval, ContainsTheImprovementOfTheNextDay) {
  std::mt19937_64 random(11);
  int covered = 0;
  double width = 0;
  for (int pair = 0; pair < 200; ++pair) {
    const double memory = pair % 2 == 0 ? 0 : 0.9;
    const Day here = day(random, memory), next = day(random, memory);
    const auto interval = next_improvement(here.before, here.after, "here");
    const auto further = measure_bias_stability(next.before, next.after, {}, Divisor::kN, "next");
    ASSERT_TRUE(interval && further);
    EXPECT_LT(interval->low, interval->value);
    EXPECT_LT(interval->value, interval->high);
    covered += *further->improvement >= interval->low && *further->improvement <= interval->high;
    width += interval->high - interval->low;
  }
  EXPECT_GE(covered, 180);
  EXPECT_LE(covered, 198);
  EXPECT_LT(width / 200, 0.3);
}

TEST(ImprovementInterval, TheSameImprovementTwiceIsNotDistinguishable) {
  std::mt19937_64 random(3);
  const Day made = day(random, 0.9);
  std::vector<double> similar = made.after, worse = made.after;
  const std::vector<double> noise = coloured(924, 0, 0.0005, random), more = coloured(924, 0, 0.012, random);
  for (std::size_t i = 0; i < similar.size(); ++i) {
    similar[i] += noise[i];
    worse[i] += more[i];
  }
  const auto same = next_difference(made.before, made.after, similar, "same");
  const auto apart = next_difference(made.before, made.after, worse, "apart");
  ASSERT_TRUE(same && apart);
  EXPECT_TRUE(same->holds_zero()) << same->low << " to " << same->high;
  EXPECT_LT(apart->high, 0);
  EXPECT_LT(apart->value, -0.1);
}

TEST(ImprovementInterval, TheBlockLengthFollowsTheAutocorrelation) {
  std::mt19937_64 random(5);
  const auto white = bootstrap_block(coloured(2000, 0, 1, random));
  const auto some = bootstrap_block(coloured(2000, 0.8, 1, random));
  const auto long_ago = bootstrap_block(coloured(2000, 0.98, 1, random));
  EXPECT_LE(white, 4u);
  EXPECT_GT(some, 10u);  // (2 G²/D)^(1/3) N^(1/3) with G = 2 φ/(1 − φ)², g = (1 + φ)/(1 − φ): 31
  EXPECT_LT(some, 60u);
  EXPECT_GT(long_ago, 60u);
  EXPECT_LE(long_ago, 500u);
  EXPECT_EQ(bootstrap_block(std::vector<double>(100, 1.0)), 1u);
}

// Recordings with a ratio of 0.5 ± 12 %.
TEST(ImprovementInterval, OfSeveralRecordingsContainsTheNextOne) {
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  const auto next = [&] { return 1 - 0.5 * std::exp(0.12 * normal(random)); };
  int covered = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const std::vector<double> seen = {next(), next(), next(), next()};
    const auto interval = next_of_several(seen, "four");
    ASSERT_TRUE(interval);
    const double further = next();
    covered += further >= interval->low && further <= interval->high;
  }
  EXPECT_GE(covered, 366);  // 380 expected, 1 sigma 4.4
  EXPECT_LE(covered, 394);
  EXPECT_EQ(next_of_several(std::vector{0.5, 0.6}, "two").error().text(),
            "two: found 2 recordings, expected 3 or more to estimate their scatter");
  EXPECT_FALSE(next_of_several(std::vector{0.5, 0.6, 1.0}, "one"));
  EXPECT_FALSE(next_of_several(std::vector{0.5, 0.6, std::nan("")}, "none"));
}

TEST(ImprovementInterval, RejectsSeriesWithoutAnInterval) {
  const std::vector<double> few(19, 1.0), constant(30, 1.0);
  std::vector<double> moving(30), gapped(30);
  for (std::size_t i = 0; i < 30; ++i) moving[i] = gapped[i] = std::sin(static_cast<double>(i));
  gapped[7] = std::nan("");
  EXPECT_FALSE(next_improvement(few, few, "few"));
  EXPECT_FALSE(next_improvement(moving, few, "lengths"));
  EXPECT_FALSE(next_improvement(constant, moving, "constant"));
  EXPECT_FALSE(next_improvement(moving, constant, "constant"));
  EXPECT_FALSE(next_improvement(moving, gapped, "gapped"));
  EXPECT_FALSE(next_difference(moving, moving, gapped, "gapped"));
}

}  // namespace
}  // namespace prism::evaluation
