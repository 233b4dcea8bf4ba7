// SPDX-License-Identifier: MIT
// Stability, improvement, floor and explained fraction of series with a known truth.
#include "compensation/evaluation/bias_stability.hpp"

#include <gtest/gtest.h>

#include "tests/unit/evaluation/random_series.hpp"

namespace prism::evaluation {
namespace {

TEST(BiasStability, ReturnsThePercentagesOfThePaper) {
  // Table 5, last row but one: 0.01850 before, 0.00718 after: 61.19 %.
  const std::vector<double> raw = {-0.01850, 0.01850}, corrected = {-0.00718, 0.00718};
  const BiasStability result = measure_bias_stability(raw, corrected, {}, Divisor::kN, "x").value();
  EXPECT_DOUBLE_EQ(result.before.sd, 0.01850);
  EXPECT_DOUBLE_EQ(result.after.sd, 0.00718);
  EXPECT_NEAR(*result.improvement, 0.6119, 5e-5);
}

TEST(BiasStability, FindsTheFloorUnderASlowDrift) {
  const std::size_t count = 20000;
  std::vector<double> raw = test::white_noise(count, 0.007, 1), noise = raw;
  for (std::size_t i = 0; i < count; ++i) raw[i] += 0.02 * std::sin(static_cast<double>(i) / 300);
  const BiasStability result = measure_bias_stability(raw, noise, {}, Divisor::kNMinus1, "x").value();
  EXPECT_NEAR(*result.floor_deg_per_h, 0.007, 0.00015);  // 4 sigma of 0.007 · sqrt(3 / (4 · 20000)), and the drift
  EXPECT_NEAR(*result.explained, 1.0, 0.01);             // the rest is the simulated noise
}

TEST(BiasStability, DoesNotCountAStepOverAGapAsNoise) {
  const std::vector<double> blocks = {1, 1, 1, 5, 5, 5};
  EXPECT_DOUBLE_EQ(noise_floor(blocks, {false, true, true, false, true, true}).value(), 0);
  EXPECT_GT(noise_floor(blocks, {}).value(), 1);
}

TEST(BiasStability, ReturnsNulloptIfAValueIsNotDefined) {
  const std::vector<double> constant(10, 3.0);
  const BiasStability result = measure_bias_stability(constant, constant, {}, Divisor::kN, "x").value();
  EXPECT_FALSE(result.improvement);
  EXPECT_FALSE(result.explained);
  EXPECT_EQ(result.floor_deg_per_h, 0);
}

TEST(BiasStability, ExplainsNothingOfWhiteNoise) {
  const std::vector<double> raw = test::white_noise(500, 1, 3);
  const BiasStability result = measure_bias_stability(raw, raw, {}, Divisor::kN, "x").value();
  EXPECT_TRUE(!result.explained || std::abs(*result.explained) < 1e-9);  // nothing was explained
}

TEST(BiasStability, RejectsSeriesOfDifferentLengths) {
  const std::vector<double> two = {1, 2}, three = {1, 2, 3}, one = {1};
  EXPECT_EQ(measure_bias_stability(two, three, {}, Divisor::kN, "x").error().text(),
            "x: found 2 raw and 3 corrected blocks, expected equal numbers");
  EXPECT_FALSE(measure_bias_stability(two, two, {true}, Divisor::kN, "x"));
  EXPECT_FALSE(measure_bias_stability(one, one, {}, Divisor::kN, "x"));
}

}  // namespace
}  // namespace prism::evaluation
