// SPDX-License-Identifier: MIT
// Allan deviation compared with the published values of NIST SP 1065 (2008), section 12, to their last printed digit.
#include "compensation/evaluation/allan.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/unit/evaluation/random_series.hpp"

namespace prism::evaluation {
namespace {

/// The 1 000 frequencies of the standard: n ← 16807 n mod 2147483647 from 1234567890, each divided by the modulus.
std::vector<double> thousand_frequencies() {
  std::vector<double> values;
  std::uint64_t n = 1234567890;
  for (int i = 0; i < 1000; ++i) {
    values.push_back(static_cast<double>(n) / 2147483647.0);
    n = 16807 * n % 2147483647;
  }
  return values;
}

std::vector<std::string> printed(const std::vector<double>& rate, std::vector<std::size_t> sizes,
                                 AllanEstimator estimator, const char* format) {
  std::vector<std::string> texts;
  const auto curve = allan_deviation(rate, 1, sizes, estimator, "test");
  for (const AllanPoint& point : curve->points) texts.push_back(fmt::format(fmt::runtime(format), point.deviation));
  return texts;
}

TEST(Allan, MatchesTheStandardsNineFrequencies) {
  const std::vector<double> nine = {892, 809, 823, 798, 671, 644, 883, 903, 677};
  EXPECT_EQ(printed(nine, {1, 2}, AllanEstimator::kOverlapping, "{:.5f}"),
            (std::vector<std::string>{"91.22945", "85.95287"}));
}

TEST(Allan, MatchesTheStandardsThousandFrequencies) {
  const std::vector<double> thousand = thousand_frequencies();
  EXPECT_EQ(printed(thousand, {1, 10, 100}, AllanEstimator::kOverlapping, "{:.6e}"),
            (std::vector<std::string>{"2.922319e-01", "9.159953e-02", "3.241343e-02"}));
  EXPECT_EQ(printed(thousand, {1, 10, 100}, AllanEstimator::kNonOverlapping, "{:.6e}"),
            (std::vector<std::string>{"2.922319e-01", "9.965736e-02", "3.897804e-02"}));
}

/// The definition: cluster means and their differences.
double slow_overlapping(const std::vector<double>& y, std::size_t m) {
  double sum = 0;
  std::size_t terms = 0;
  for (std::size_t j = 0; j + 2 * m <= y.size(); ++j, ++terms) {
    const auto at = y.begin() + static_cast<std::ptrdiff_t>(j), mid = at + static_cast<std::ptrdiff_t>(m);
    const double first = std::accumulate(at, mid, 0.0) / static_cast<double>(m);
    const double second = std::accumulate(mid, mid + static_cast<std::ptrdiff_t>(m), 0.0) / static_cast<double>(m);
    sum += (second - first) * (second - first);
  }
  return std::sqrt(sum / (2 * static_cast<double>(terms)));
}

TEST(Allan, EqualsItsDefinitionAtEverySize) {
  const std::vector<double> rate = test::random_walk(157, 1, 2);
  for (std::size_t m = 1; 2 * m <= rate.size(); ++m) {
    const std::vector<std::size_t> size = {m};
    const auto curve = allan_deviation(rate, 1, size, AllanEstimator::kOverlapping, "test");
    EXPECT_NEAR(curve->points.at(0).deviation, slow_overlapping(rate, m), 1e-12 * slow_overlapping(rate, m)) << m;
  }
}

TEST(Allan, KeepsPrecisionWithAnEarthRate) {
  std::vector<double> rate = test::white_noise(100000, 1e-3, 4), lifted = rate;
  for (double& value : lifted) value += 15.0;
  const std::vector<std::size_t> sizes = {1, 1000};
  const auto a = allan_deviation(rate, 1, sizes, AllanEstimator::kOverlapping, "x");
  const auto b = allan_deviation(lifted, 1, sizes, AllanEstimator::kOverlapping, "x");
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(b->points[i].deviation / a->points[i].deviation, 1, 1e-8);
}

TEST(Allan, PoolsTheRecordsBetweenBreaks) {
  // Two records with different levels: a pair across the break would include the step of 100.
  std::vector<double> rate = test::white_noise(4000, 1, 7);
  for (std::size_t i = 2000; i < 4000; ++i) rate[i] += 100;
  rate[2000] = kAllanBreak;
  const std::vector<std::size_t> sizes = {1, 10};
  const auto curve = allan_deviation(rate, 1, sizes, AllanEstimator::kOverlapping, "x").value();
  EXPECT_EQ(curve.holes, 1u);
  EXPECT_EQ(curve.missing, 0u);
  EXPECT_EQ(curve.runs, 2u);
  EXPECT_EQ(curve.records, (std::vector<std::size_t>{2000, 1999}));
  EXPECT_EQ(curve.values, 3999u);
  EXPECT_NEAR(curve.points[0].deviation, 1, 0.08);
  EXPECT_NEAR(curve.points[1].deviation, std::sqrt(0.1), 0.05);
}

/// The values minus their least-squares line; returns its slope.
double remove_line(std::vector<double>& y) {
  double n = 0, t = 0, v = 0, tt = 0, tv = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double at = static_cast<double>(i);
    if (std::isfinite(y[i])) n += 1, t += at, v += y[i], tt += at * at, tv += at * y[i];
  }
  const double slope = (tv - t * v / n) / (tt - t * t / n);
  for (std::size_t i = 0; i < y.size(); ++i) y[i] -= v / n + slope * (static_cast<double>(i) - t / n);
  return slope;
}

/// The definition for a record with missing values and without quantisation, with the rules of allan_deviation().
double slow_with_gaps(std::vector<double> y, std::size_t m) {
  const double slope = remove_line(y), size = static_cast<double>(m);
  struct Mean {
    double sum = 0, values = 0;
  };
  std::vector<Mean> before(1);
  for (const double value : y) {
    before.push_back(before.back());
    if (std::isfinite(value)) before.back().sum += value, ++before.back().values;
  }
  const auto mean = [&](std::size_t from) {
    return Mean{before[from + m].sum - before[from].sum, before[from + m].values - before[from].values};
  };
  for (const std::size_t most : {std::size_t{0}, m / 4}) {
    double squares = 0, used = 0, every = 0;  // differences from the line
    std::size_t terms = 0, all = 0;
    for (std::size_t j = 0; j + 2 * m <= y.size(); ++j, ++all) {
      const Mean a = mean(j), b = mean(j + m);
      every += b.sum - a.sum;
      if (std::min(a.values, b.values) < size - static_cast<double>(most)) continue;
      const double scale = std::sqrt(2 / (size / a.values + size / b.values));
      const double d = scale * (size * b.sum / b.values - size * a.sum / a.values);
      squares += d * d;
      used += d;
      ++terms;
    }
    if (most == 0 && m >= 4 && 10 * terms < 9 * all) continue;
    const double n = static_cast<double>(terms), whole = slope * size * size + every / static_cast<double>(all);
    return std::sqrt((squares - used * used / n + n * whole * whole) / (2 * n)) / size;
  }
  return 0;
}

// 1 % of lost rows. Before, a pair of clusters had to be between two gaps: the curve ended at 64 of 3 000 values.
TEST(Allan, LostValuesDoNotCostTheLongAveragingTimes) {
  std::vector<double> rate = test::white_noise(3000, 1, 8);
  for (std::size_t i = 0; i < rate.size(); ++i) rate[i] += 0.01 * static_cast<double>(i);  // a ramp
  const std::vector<double> whole = rate;
  for (std::size_t i = 50; i < rate.size(); i += 97 + i % 7) rate[i] = std::nan("");
  rate[1500] = rate[1501] = rate[1502] = std::nan("");
  const auto sizes = allan_cluster_sizes(AllanGrid::kOctave, rate.size());
  const auto curve = allan_deviation(rate, 1, sizes, AllanEstimator::kOverlapping, "x").value();
  ASSERT_EQ(curve.points.size(), sizes.size());
  const auto complete = allan_deviation(whole, 1, sizes, AllanEstimator::kOverlapping, "x").value();
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const double slow = slow_with_gaps(rate, sizes[i]);
    EXPECT_NEAR(curve.points[i].deviation, slow, 1e-9 * slow) << sizes[i];
    EXPECT_NEAR(curve.points[i].deviation / complete.points[i].deviation, 1, 0.2) << sizes[i];
  }
  EXPECT_EQ(curve.points.back().terms, complete.points.back().terms);
  EXPECT_EQ(curve.missing, 3000u - curve.values);
}

TEST(Allan, GridsAgreeWithTheirNames) {
  EXPECT_EQ(allan_cluster_sizes(AllanGrid::kOctave, 30), (std::vector<std::size_t>{1, 2, 4, 8}));
  EXPECT_EQ(allan_cluster_sizes(AllanGrid::kDecade, 130), (std::vector<std::size_t>{1, 2, 4, 10, 20, 40}));
  const auto dense = allan_cluster_sizes(AllanGrid::kDense, 3'000'000);
  EXPECT_EQ(dense.front(), 1u);
  EXPECT_GT(dense.size(), 75u);
  EXPECT_LT(dense.size(), 95u);
  EXPECT_TRUE(allan_cluster_sizes(AllanGrid::kOctave, 2).empty());
}

TEST(Allan, RejectsShortAndEmptyRecordsAndAnInvalidInterval) {
  const std::vector<std::size_t> one = {1};
  EXPECT_EQ(allan_deviation(std::span<const double>(), 1, one, AllanEstimator::kOverlapping, "log.csv").error().text(),
            "log.csv: found 0 values in 0 segments without a gap, expected at least 3 in one segment");
  const std::vector<double> ridden = {1, 2, std::nan(""), 1, 2, std::nan(""), 5};
  EXPECT_FALSE(allan_deviation(ridden, 1, one, AllanEstimator::kOverlapping, "x"));
  const std::vector<double> good = {1, 2, 3, 4};
  EXPECT_FALSE(allan_deviation(good, 0, one, AllanEstimator::kOverlapping, "x"));
  EXPECT_FALSE(allan_deviation(good, std::nan(""), one, AllanEstimator::kOverlapping, "x"));
}

TEST(Allan, OfAConstantIsZero) {
  const std::vector<double> constant(100, 0.1);
  const std::vector<std::size_t> sizes = {1, 4};
  const auto curve = allan_deviation(constant, 1, sizes, AllanEstimator::kOverlapping, "x").value();
  for (const AllanPoint& point : curve.points) EXPECT_EQ(point.deviation, 0);
}

// The phase is computed in pieces, in a window that moves over the record, and large clusters take other pieces.
TEST(Allan, DoesNotDependOnHowALongRecordIsDivided) {
  std::vector<double> rate = test::white_noise(1'500'000, 1, 5);
  const std::vector<std::size_t> sizes = {1, 3, 1000, 262'144, 300'001};
  for (const bool gaps : {false, true}) {
    if (gaps) {
      rate[1] = kAllanBreak;
      rate[4095] = rate[1'200'000] = rate[1'200'001] = rate.back() = std::nan("");
    }
    const auto curve = allan_deviation(rate, 1, sizes, AllanEstimator::kOverlapping, "test").value();
    ASSERT_EQ(curve.points.size(), sizes.size());
    const std::vector<double> longest(rate.begin() + (gaps ? 2 : 0), rate.end() - gaps);
    for (const AllanPoint& point : curve.points) {
      const double slow = slow_with_gaps(longest, point.m);
      EXPECT_NEAR(point.deviation, slow, 1e-9 * slow) << point.m;
    }
    EXPECT_EQ(curve.points[4].terms, longest.size() - 2 * 300'001 + 1);
  }
}

}  // namespace
}  // namespace prism::evaluation
