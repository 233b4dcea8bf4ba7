// SPDX-License-Identifier: MIT
// Statistics of series with a known truth: compared with hand calculations.
#include "compensation/evaluation/statistics.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include "compensation/evaluation/improvement_interval.hpp"
#include "tests/support/power_law_noise.hpp"
#include "tests/support/random_series.hpp"

namespace prism::evaluation {
namespace {

using Series = std::vector<double>;
using ::testing::DoubleNear, ::testing::Pointwise;
const double kNan = std::nan("");

TEST(SummaryStatistics, NamesAndUsesBothDivisors) {
  const Series values = {2, 4, 4, 4, 5, 5, 7, 9};  // mean 5, sum of squared deviations 32
  const SummaryStatistics n = summarise(values, Divisor::kN).value();
  EXPECT_DOUBLE_EQ(n.sd, 2.0);
  EXPECT_DOUBLE_EQ(summarise(values, Divisor::kNMinus1)->sd, std::sqrt(32.0 / 7.0));
  EXPECT_DOUBLE_EQ(n.mean, 5);
  EXPECT_DOUBLE_EQ(n.rms, std::sqrt(232.0 / 8.0));
  EXPECT_DOUBLE_EQ(n.peak_to_peak, 7);
  EXPECT_STREQ(divisor_text(Divisor::kN), "N");
  EXPECT_STREQ(divisor_text(Divisor::kNMinus1), "N-1");
  // With a large offset the one-pass formula Σx² − N m² gives 0 or noise.
  EXPECT_NEAR(summarise(Series{1e9 + 1, 1e9 + 2, 1e9 + 3}, Divisor::kNMinus1)->sd, 1.0, 1e-12);
  EXPECT_EQ(summarise(Series(1000, 0.1), Divisor::kN)->sd, 0) << "of a constant exactly 0";
  EXPECT_EQ(neumaier_sum(Series{1, 1e100, 1, -1e100}), 2);
  EXPECT_EQ(median_of({3, 1, 2}), 2);
  EXPECT_EQ(median_of({4, 1, 3, 2}), 2.5);
  EXPECT_NEAR(robust_sd({-2, -1, 0, 1, 2, 1e6}), 1.4826 * 1.5, 1e-12);
}

TEST(Correlation, MatchesAHandCalculation) {
  const std::tuple<Series, Series, double> rows[] = {
      {{1, 2, 3, 5}, {12, 14, 16, 20}, 1},      // a line
      {{1, 2, 3, 5}, {-1, -2, -3, -5}, -1},     // its mirror
      {{1, 2, 3, 4, 5}, {2, 1, 5, 3, 4}, 0.6},  // Σdxdy = 6, Σdx² = 10, Σdy² = 10
      {{1e-200, 2e-200, 3e-200}, {1e200, 2e200, 3e200}, 1}};
  for (const auto& [x, y, expected] : rows) EXPECT_NEAR(correlate(x, y).value(), expected, 1e-15);
}

TEST(Autocorrelation, OfAFirstOrderProcessFallsGeometricallyAndOfWhiteNoiseStaysInItsBand) {
  const Series drive = test::white_noise(200000, 1, 5);
  Series y(drive.size());
  for (std::size_t i = 1; i < y.size(); ++i) y[i] = 0.8 * y[i - 1] + drive[i];
  const Autocorrelation result = autocorrelate(y, 3).value();
  EXPECT_DOUBLE_EQ(result.coefficient[0], 1);
  EXPECT_NEAR(result.coefficient[1], 0.8, 0.01);  // sd of r_1 is sqrt((1 − 0.64) / N) = 0.0013
  EXPECT_NEAR(result.coefficient[3], 0.512, 0.02);
  const Autocorrelation white = autocorrelate(test::white_noise(10000, 1, 6), 100).value();
  int outside = 0;
  for (std::size_t lag = 1; lag <= 100; ++lag) outside += std::abs(white.coefficient[lag]) > white.band;
  EXPECT_LE(outside, 12);  // 5 expected; 12 is more than three sigma above
  EXPECT_EQ(autocorrelate(Series{1, 2, 4}, 50)->coefficient.size(), 3u) << "limited to the length of the series";
}

TEST(Autocorrelation, IsTheSumOfProductsOverTheSumOfSquares) {
  // Deviations from the mean: -2.4, -0.4, -1.4, 3.6, 0.6.
  const std::vector<double> expected = {1, -1.36 / 21.2, 1.08 / 21.2, -8.88 / 21.2, -1.44 / 21.2};
  EXPECT_THAT(autocorrelate(Series{1, 3, 2, 7, 4}, 9)->coefficient, Pointwise(DoubleNear(1e-15), expected));
  EXPECT_DOUBLE_EQ(neighbour_correlation(Series{1, 3, 2, 7, 4}), expected[1]);
}

TEST(BiasStability, ReturnsThePercentagesOfThePaper) {
  // Table 5, last row but one: 0.01850 before, 0.00718 after: 61.19 %.
  const BiasStability result =
      measure_bias_stability(Series{-0.01850, 0.01850}, Series{-0.00718, 0.00718}, {}, Divisor::kN);
  EXPECT_DOUBLE_EQ(result.before.sd, 0.01850);
  EXPECT_DOUBLE_EQ(result.after.sd, 0.00718);
  EXPECT_NEAR(*result.improvement, 0.6119, 5e-5);
}

TEST(BiasStability, FindsTheFloorUnderASlowDriftWithoutStepsOverGaps) {
  Series raw = test::white_noise(20000, 0.007, 1), noise = raw;
  for (std::size_t i = 0; i < raw.size(); ++i) raw[i] += 0.02 * std::sin(static_cast<double>(i) / 300);
  const BiasStability result = measure_bias_stability(raw, noise, {}, Divisor::kNMinus1);
  EXPECT_NEAR(*result.floor_deg_per_h, 0.007, 0.00015);  // 4 sigma of 0.007 · sqrt(3 / (4 · 20000)), and the drift
  EXPECT_NEAR(*result.explained, 1.0, 0.01);             // the rest is the simulated noise
  const Series blocks = {1, 1, 1, 5, 5, 5};
  EXPECT_DOUBLE_EQ(noise_floor(blocks, {false, true, true, false, true, true}).value(), 0);
  EXPECT_GT(noise_floor(blocks, {}).value(), 1);
}

TEST(BiasStability, ReturnsNulloptIfAValueIsNotDefined) {
  const Series constant(10, 3.0), white = test::white_noise(500, 1, 3);
  const BiasStability result = measure_bias_stability(constant, constant, {}, Divisor::kN);
  EXPECT_FALSE(result.improvement);
  EXPECT_FALSE(result.explained);
  EXPECT_EQ(result.floor_deg_per_h, 0);
  const BiasStability nothing = measure_bias_stability(white, white, {}, Divisor::kN);
  EXPECT_NEAR(nothing.explained.value_or(0), 0, 1e-9);
}

TEST(Statistics, AreNulloptForSeriesThatTheyAreNotDefinedFor) {
  const Series one = {1}, two = {1, 2}, three = {1, 2, 3}, constant = {7, 7, 7};
  EXPECT_FALSE(summarise({}, Divisor::kN));
  EXPECT_FALSE(summarise(one, Divisor::kN));
  EXPECT_FALSE(summarise(Series{1, 2, kNan}, Divisor::kN));
  EXPECT_FALSE(correlate(three, constant));
  EXPECT_FALSE(correlate(two, two));
  EXPECT_FALSE(correlate(three, two));
  EXPECT_FALSE(correlate(three, Series{1, 2, kNan}));
  EXPECT_FALSE(autocorrelate(constant, 2));
}

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
    const auto interval = next_improvement(here.before, here.after);
    const auto further = measure_bias_stability(next.before, next.after, {}, Divisor::kN);
    ASSERT_TRUE(interval);
    EXPECT_LT(interval->low, interval->value);
    EXPECT_LT(interval->value, interval->high);
    covered += *further.improvement >= interval->low && *further.improvement <= interval->high;
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
  const auto same = next_difference(made.before, made.after, similar);
  const auto apart = next_difference(made.before, made.after, worse);
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

// Sums of `width` neighbours of a series without memory; the expected lengths are those of a script that follows
// Politis and White (2004).
TEST(ImprovementInterval, TheBlockLengthIsThatOfPolitisAndWhite) {
  const auto block = [](std::size_t n, std::size_t width, double trend = 0) {
    std::vector<double> series(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = i; k < i + width; ++k) series[i] += std::sin(static_cast<double>(k * k));
      series[i] += trend * static_cast<double>(i);
    }
    return bootstrap_block(series);
  };
  for (const auto& [n, width, expected] : {std::tuple<std::size_t, std::size_t, std::size_t>{7, 2, 1},
                                           {16, 3, 2},
                                           {56, 5, 3},
                                           {100, 1, 3},
                                           {100, 3, 5},
                                           {101, 8, 10},
                                           {200, 4, 9},
                                           {400, 1, 3},
                                           {400, 5, 11},
                                           {400, 60, 37},
                                           {924, 25, 176}})
    EXPECT_EQ(block(n, width), expected) << n << " " << width;
  EXPECT_EQ(block(23, 1, 1), 5u) << "at most a quarter of the values";
  EXPECT_EQ(block(100, 1, 0.1), 25u);
}

// n = 3 and 4: Student's t is 4.3027 and 3.1824. The logarithms differ by ln 2.
TEST(ImprovementInterval, OfSeveralRecordingsIsThatOfStudent) {
  const double far = 4.302652729749464 * std::log(2) * std::sqrt(4.0 / 3);
  const auto three = next_of_several(std::vector{0.5, 0.75, 0.875});
  ASSERT_TRUE(three);
  EXPECT_NEAR(three->value, 0.75, 1e-12);
  EXPECT_NEAR(three->low, 1 - 0.25 * std::exp(far), 1e-9);
  EXPECT_NEAR(three->high, 1 - 0.25 * std::exp(-far), 1e-12);
}

/// A sine of amplitude 1, and `sd` of white noise, which a model leaves.
Day white_day(std::size_t n, double sd, std::mt19937_64& random) {
  Day made{{}, coloured(n, 0, sd, random)};
  for (std::size_t i = 0; i < n; ++i) made.before.push_back(std::sin(static_cast<double>(i) / 7) + made.after[i]);
  return made;
}

/// Variance of the standard deviation of independent values, relative to its square.
double variance_of_sd(const std::vector<double>& values) {
  double squares = 0, fourth = 0, n = static_cast<double>(values.size());
  const double mean = neumaier_sum(values) / n;
  for (const double value : values) squares += std::pow(value - mean, 2) / n, fourth += std::pow(value - mean, 4) / n;
  return (fourth / (squares * squares) - 1) / n / 4;
}

TEST(ImprovementInterval, OfWhiteNoiseIsThatOfItsStandardDeviation) {
  std::mt19937_64 random(21);
  const Day made = white_day(400, 0.001, random);
  const auto interval = next_improvement(made.before, made.after);
  ASSERT_TRUE(interval);
  const double low = std::log(1 - interval->low), here = std::log(1 - interval->value),
               high = std::log(1 - interval->high);
  EXPECT_NEAR(here, std::log(summarise(made.after, Divisor::kN)->sd / summarise(made.before, Divisor::kN)->sd), 1e-12);
  EXPECT_NEAR(low - here, here - high, 1e-9);
  // Here and there scatter alike, but for what repeats; between days, 1.96 of the standard deviation. Student's t of
  // more than 100 blocks is 1.97.
  const double days = std::sqrt(2.0) * 1.96 * kBetweenDays;
  const double scatter = std::sqrt((std::pow(low - here, 2) - days * days) / (1 - kRepeats) / 2) / 1.97;
  EXPECT_NEAR(scatter, std::sqrt(variance_of_sd(made.after)), 0.07 * scatter);
}

// The draws themselves: the numbers are those of this test's first run.
TEST(ImprovementInterval, OfAShortRecordIsAsEver) {
  std::vector<double> before, after;
  for (int i = 0; i < 24; ++i) after.push_back(std::sin(i * i)), before.push_back(5 * std::sin(i / 2.0) + after.back());
  const auto interval = next_improvement(before, after);
  ASSERT_TRUE(interval);
  EXPECT_EQ(bootstrap_block(after), 4u);
  EXPECT_NEAR(interval->low, 0.716819724105, 1e-9);
  EXPECT_NEAR(interval->high, 0.854853037796, 1e-9);
  after.erase(after.begin(), after.begin() + 4), before.resize(20);
  EXPECT_TRUE(next_improvement(before, after));
}

TEST(ImprovementInterval, OfADifferenceIsThatOfBothStandardDeviations) {
  std::mt19937_64 random(22);
  const std::vector<double> good = coloured(400, 0, 0.1, random), worse = coloured(400, 0, 0.2, random);
  std::vector<double> before;  // each part of it has the standard deviation 2
  for (int i = 0; i < 400; ++i) before.push_back(i % 2 ? 2 : -2);
  const auto interval = next_difference(before, good, worse);
  ASSERT_TRUE(interval);
  const double first = summarise(good, Divisor::kN)->sd, second = summarise(worse, Divisor::kN)->sd;
  EXPECT_NEAR(interval->value, (first - second) / 2, 1e-12);
  EXPECT_NEAR(interval->value - interval->low, interval->high - interval->value, 1e-12);
  const double sd = std::sqrt(first * first * variance_of_sd(good) + second * second * variance_of_sd(worse)) / 2;
  EXPECT_NEAR((interval->high - interval->value) / std::sqrt(2.0) / 1.97, sd, 0.1 * sd);
}

// The ramp that both leave does not make the blocks of their difference longer: its sd is that of the two white noises,
// sqrt(2 / n) of one. With blocks of a quarter of the values the interval is 1.5 to 3 times as wide.
TEST(ImprovementInterval, TheBlocksOfADifferenceAreThoseOfItsContributions) {
  std::mt19937_64 random(23);
  const std::size_t n = 400;
  const std::vector<double> one = coloured(n, 0, 0.01, random), two = coloured(n, 0, 0.01, random);
  std::vector<double> before, first, second;
  for (std::size_t i = 0; i < n; ++i) {
    before.push_back(0.01 * static_cast<double>(i));
    first.push_back(0.5 * before[i] + one[i]);
    second.push_back(0.5 * before[i] + two[i]);
  }
  EXPECT_EQ(bootstrap_block(first), n / 4);
  const auto interval = next_difference(before, first, second);
  ASSERT_TRUE(interval);
  const double sd = 0.01 * std::sqrt(2.0 / static_cast<double>(n)) / summarise(before, Divisor::kN)->sd;
  EXPECT_NEAR((interval->high - interval->value) / std::sqrt(2.0) / 1.97, sd, 0.2 * sd);
}

// Recordings with a ratio of 0.5 ± 12 %.
TEST(ImprovementInterval, OfSeveralRecordingsContainsTheNextOne) {
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  const auto next = [&] { return 1 - 0.5 * std::exp(0.12 * normal(random)); };
  int covered = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const std::vector<double> seen = {next(), next(), next(), next()};
    const auto interval = next_of_several(seen);
    ASSERT_TRUE(interval);
    const double further = next();
    covered += further >= interval->low && further <= interval->high;
  }
  EXPECT_GE(covered, 366);  // 380 expected, 1 sigma 4.4
  EXPECT_LE(covered, 394);
  EXPECT_NEAR(next_of_several(std::vector{0.5, 0.75, 0.75, 0.875})->value, 0.75,
              1e-12);  // by the mean logarithm
  EXPECT_FALSE(next_of_several(std::vector{0.5, 0.6}));
  EXPECT_FALSE(next_of_several(std::vector{0.5, 0.6, 1.0}));
  EXPECT_FALSE(next_of_several(std::vector{0.5, 0.6, 1.5}));
  EXPECT_FALSE(next_of_several(std::vector{0.5, 0.6, std::nan("")}));
}

TEST(ImprovementInterval, RejectsSeriesWithoutAnInterval) {
  const std::vector<double> few(19, 1.0), constant(30, 1.0);
  std::vector<double> moving(30), gapped(30);
  for (std::size_t i = 0; i < 30; ++i) moving[i] = gapped[i] = std::sin(static_cast<double>(i));
  gapped[7] = std::nan("");
  EXPECT_FALSE(next_improvement(few, few));
  EXPECT_FALSE(next_improvement(moving, few));
  EXPECT_FALSE(next_improvement(constant, moving));
  EXPECT_FALSE(next_improvement(moving, constant));
  EXPECT_FALSE(next_improvement(moving, gapped));
  EXPECT_FALSE(next_difference(moving, moving, gapped));
}

}  // namespace
}  // namespace prism::evaluation
