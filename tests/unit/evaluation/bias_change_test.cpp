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

// Errors by their number and day, one in 4 000 s; the expected numbers are those of a script in numpy (lstsq).
struct Computed {
  std::vector<double> time_s, error, sd, sd_mean;

  Computed(int count, const std::function<double(int i, double day)>& f) {
    for (int i = 0; i < count; ++i) {
      time_s.push_back(1e6 + 4000 * i);
      error.push_back(f(i, 4000.0 * i / 86400));
      sd.push_back(0.004 + 0.002 * (i % 3));
      sd_mean.push_back(0.008 + 0.001 * (i % 4));
    }
  }
  BiasChange change() const { return bias_change(time_s, error, sd, sd_mean, 0.003); }
};

TEST(BiasChange, IsThatOfLeastSquaresThroughTheMeansOfDays) {
  Computed made(200, [](int i, double day) { return 0.01 * day + 0.02 * std::sin(i * i) + 0.03 * std::sin(i / 12.0); });
  made.sd_mean.assign(200, 0.012);
  const BiasChange found = made.change();
  ASSERT_TRUE(found.per_day);
  EXPECT_NEAR(found.per_day->value, 0.009865670557419265, 1e-14);
  EXPECT_NEAR(found.per_day->sd, 0.002406667826808744, 1e-14);
  EXPECT_FALSE(found.shift);
  EXPECT_EQ(found.within, 0.635);
  EXPECT_NEAR(found.correlation, 0.6412515774708936, 1e-12);
  const BiasChange none = Computed(200, [](int i, double) { return -0.02 + 0.02 * std::sin(i * i); }).change();
  EXPECT_FALSE(none.found());
  EXPECT_EQ(none.within, 0.465);
  EXPECT_NEAR(none.correlation, -0.03741646400719133, 1e-12);
}

// 22 values fill a day of 86 400 s; the seventh begins after 528 000 s and counts if it has more than 90 % of its time.
TEST(BiasChange, ATrendNeedsSevenDays) {
  for (const int count : {152, 153})
    EXPECT_EQ(Computed(count, [](int i, double day) { return 0.01 * day + 0.001 * std::sin(i * i); })
                  .change()
                  .per_day.has_value(),
              count == 153);
}

// The deviation: the mean square of sd, and the mount.
TEST(BiasChange, AShiftIsAboveThreeDeviations) {
  const double sd = std::sqrt(0.003 * 0.003 + (16e-6 + 36e-6 + 64e-6) / 3);
  for (const double sign : {1.0, -1.0}) {
    EXPECT_FALSE(Computed(30, [=](int, double) { return sign * 2.999 * sd; }).change().shift);
    EXPECT_EQ(Computed(30, [=](int, double) { return sign * 0.5; }).change().shift, sign * 0.5);
    EXPECT_NEAR(*Computed(30, [=](int, double) { return sign * 3.001 * sd; }).change().shift, sign * 3.001 * sd, 1e-12);
  }
}

}  // namespace
}  // namespace prism::evaluation
