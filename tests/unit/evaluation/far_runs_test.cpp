// SPDX-License-Identifier: MIT
// Runs without information are found with their exact ends, and nothing else is.
#include "compensation/evaluation/far_runs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "tests/unit/evaluation/random_series.hpp"

namespace prism::evaluation {
namespace {

constexpr std::size_t kCount = 4000;
constexpr FarLimits kLimits{2.5, 60, 200, true};

/// Drift of 1 and noise of 0.05.
std::vector<double> good_values() {
  std::vector<double> values = test::white_noise(kCount, 0.05, 1);
  for (std::size_t i = 0; i < kCount; ++i) values[i] += 8.4 + std::sin(static_cast<double>(i) / 400);
  return values;
}

void fill(std::vector<double>& values, std::size_t begin, std::size_t count, double value) {
  std::fill_n(values.begin() + static_cast<std::ptrdiff_t>(begin), count, value);
}

TEST(FarRuns, FindsACodeOfAnyLengthUpToHalfWithItsEnds) {
  EXPECT_TRUE(far_runs(good_values(), kLimits).empty());
  for (const std::size_t count : {1, 30, 201, 1200, 1990}) {
    for (const std::size_t begin : {std::size_t(0), std::size_t(700), kCount - count}) {
      for (const double code : {9999.0, 1e9, -999.0, 0.0}) {  // 0 is less than `absurd`, but constant
        std::vector<double> values = good_values();
        fill(values, begin, count, code);
        const std::vector<FarRun> runs = far_runs(values, kLimits);
        ASSERT_EQ(runs.size(), 1u) << begin << " " << count << " " << code;
        EXPECT_EQ(runs[0].begin, begin) << count;
        EXPECT_EQ(runs[0].end, begin + count);
        EXPECT_EQ(runs[0].level, code);
      }
    }
  }
}

TEST(FarRuns, FindsACodeNearTheOtherValues) {
  FarLimits limits = kLimits;
  limits.far = 50;
  limits.code = 0.4;
  std::vector<double> values = good_values();
  for (const std::size_t row : {400, 401, 1200, 3999}) values[row] = 0;
  const std::vector<FarRun> runs = far_runs(values, limits);
  ASSERT_EQ(runs.size(), 3u);
  EXPECT_EQ(runs[0].end - runs[0].begin, 2u);
  values[1200] = 0.01;  // another value: no code
  EXPECT_TRUE(far_runs(values, limits).empty());
  EXPECT_TRUE(far_runs(good_values(), limits).empty());
}

TEST(FarRuns, LeavesStepsAndLongChangesThatMayBeTrue) {
  std::vector<double> moved = good_values(), turned = good_values();
  for (std::size_t i = 2500; i < kCount; ++i) moved[i] += 15;
  for (std::size_t i = 1000; i < 1500; ++i) turned[i] += 15;
  EXPECT_TRUE(far_runs(moved, kLimits).empty());
  EXPECT_TRUE(far_runs(turned, kLimits).empty());
  std::vector<double> steps(kCount, 20.0);  // a set point: it is constant before and after, too
  fill(steps, 1000, 500, 40);
  EXPECT_TRUE(far_runs(steps, kLimits).empty());
}

TEST(ConstantRuns, TellAStoppedSourceFromACoarseOne) {
  std::vector<double> stopped = good_values();
  fill(stopped, 1000, 300, 8.5);
  const std::vector<ConstantRun> runs = constant_runs(stopped, 60);
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].begin, 1000u);
  EXPECT_EQ(runs[0].end, 1300u);
  EXPECT_TRUE(runs[0].certain);
  std::vector<double> coarse = good_values();
  for (double& value : coarse) value = std::round(value);
  for (const ConstantRun& run : constant_runs(coarse, 60)) EXPECT_FALSE(run.certain) << run.begin;
  EXPECT_TRUE(constant_runs(std::vector<double>(kCount, 5.0), 60).empty());
  // A step of the resolution that is larger than the noise: it flickers only where it changes.
  std::vector<double> coarser = test::white_noise(kCount, 0.05, 2);
  for (std::size_t i = 0; i < kCount; ++i) coarser[i] = std::round((i < kCount / 2 ? 8.9 : 8.5) + coarser[i]);
  for (const ConstantRun& run : constant_runs(coarser, 60)) EXPECT_FALSE(run.certain) << run.begin << " " << run.end;
}

TEST(NoiseOfSteps, DoesNotDependOnAConstantHalf) {
  std::vector<double> values = good_values();
  fill(values, 0, kCount / 2, 9999);
  EXPECT_NEAR(noise_of_steps(values), 0.05, 0.005);
  EXPECT_EQ(noise_of_steps(std::vector<double>(10, 5.0)), 0);
}

}  // namespace
}  // namespace prism::evaluation
