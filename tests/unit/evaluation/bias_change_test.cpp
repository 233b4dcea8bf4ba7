// SPDX-License-Identifier: MIT
// A shift, a trend, a missing input and a wrong sd are told apart.
#include "compensation/evaluation/bias_change.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "tests/support/random_series.hpp"

namespace prism::evaluation {
namespace {

constexpr double kNoise = 0.0064, kSd = 0.005, kMount = 0.0124;

/// Blocks of 100 s whose errors are white noise + error(days).
BiasChange changed(double days, const std::function<double(double days)>& error, std::uint64_t seed = 1) {
  const auto count = static_cast<std::size_t>(days * 864);
  std::vector<double> errors = test::white_noise(count, kNoise, seed), time_s, sd(count, kSd);
  for (std::size_t i = 0; i < count; ++i) {
    time_s.push_back(1.7e9 + 100.0 * static_cast<double>(i));
    errors[i] += error(static_cast<double>(i) / 864);
  }
  return bias_change(time_s, errors, sd, std::vector<double>(count, std::hypot(kSd, kNoise)), kMount);
}

TEST(BiasChange, AGoodModelHasNone) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const BiasChange good = changed(
        20, [](double) { return 0.01; }, seed);
    EXPECT_FALSE(good.found());
    EXPECT_GT(good.within, 0.8);
  }
}

TEST(BiasChange, AShiftIsBeyondModelAndMount) {
  const BiasChange moved = changed(1, [](double) { return -0.1; });
  ASSERT_TRUE(moved.shift);
  EXPECT_NEAR(*moved.shift, -0.1, 0.001);
  EXPECT_FALSE(moved.per_day);
  EXPECT_GT(moved.within, 0.9);
}

TEST(BiasChange, ATrendHasItsInterval) {
  const BiasChange drifting = changed(20, [](double days) { return 0.002 * days; });
  ASSERT_TRUE(drifting.per_day);
  EXPECT_FALSE(drifting.shift);
  EXPECT_NEAR(drifting.per_day->value, 0.002, 4 * drifting.per_day->sd);
  EXPECT_LT(drifting.per_day->sd, 0.0001);
  EXPECT_GT(drifting.within, 0.9);
  EXPECT_FALSE(changed(5, [](double days) { return 0.002 * days; }).per_day);  // too short
}

// Two slow waves leave days that resemble their neighbours: fewer independent ones, a wider interval.
TEST(BiasChange, ASlowWaveIsNoTrend) {
  const auto wave = [](double days) { return 0.006 * days + 0.03 * std::sin(2 * std::numbers::pi * days / 10); };
  EXPECT_FALSE(changed(20, wave).per_day);
}

TEST(BiasChange, AMissingInputChangesSlowlyAndAWrongSdDoesNot) {
  const BiasChange slow = changed(10, [](double days) { return 0.05 * std::sin(2 * std::numbers::pi * days / 1.07); });
  EXPECT_FALSE(slow.found());
  EXPECT_LT(slow.within, 0.8);
  EXPECT_GT(slow.correlation, 0.5);
  test::Normal normal(3);
  const BiasChange noisy = changed(10, [&](double) { return 0.02 * normal(); });
  EXPECT_LT(noisy.within, 0.8);
  EXPECT_LT(noisy.correlation, 0.1);
}

}  // namespace
}  // namespace prism::evaluation
