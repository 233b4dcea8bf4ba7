// SPDX-License-Identifier: MIT
// Coverage of the intervals by simulation, on short records with and without lost values; `tools/bench allan-coverage`
// has 1 000 series of every noise and up to 100 000 values. Before, 20 points of white noise that were taken for
// quantisation had intervals that never held the truth, and 1 % of lost rows ended the curve at 50 values.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "compensation/evaluation/allan_coefficients.hpp"
#include "compensation/evaluation/allan_covariance.hpp"
#include "compensation/evaluation/allan_strength.hpp"
#include "tests/support/power_law_noise.hpp"
#include "tests/unit/evaluation/random_series.hpp"

namespace prism::evaluation {
namespace {

constexpr double kProbability = 0.683;

struct Process {
  const char* name;
  std::function<std::vector<double>(test::NormalPairs&)> make;
  NoiseSquares strengths;
  std::vector<double> lost;  ///< shares of lost values
};

constexpr std::size_t kValues = 1000;

NoiseSquares strengths(double q, double n, double b, double k, double r) {
  NoiseSquares squares;
  squares << q, n, b, k, r;
  return squares;
}

std::vector<Process> processes() {
  const test::Flicker flicker(kValues);
  const auto white = [](test::NormalPairs& normal) {
    std::vector<double> rate(kValues);
    for (double& value : rate) value = normal();
    return rate;
  };
  const auto ramp = [white](test::NormalPairs& normal) {
    std::vector<double> rate = white(normal);
    for (std::size_t i = 0; i < kValues; ++i) rate[i] += 0.05 * static_cast<double>(i);
    return rate;
  };
  const auto walk = [](test::NormalPairs& normal) { return test::averaged_walk(kValues, normal); };
  const auto sum = [white, walk](test::NormalPairs& normal) {
    std::vector<double> rate = white(normal);
    const std::vector<double> slow = walk(normal);
    for (std::size_t i = 0; i < kValues; ++i) rate[i] += std::sqrt(3e-3) * slow[i];
    return rate;
  };
  return {{"white", white, strengths(0, 1, 0, 0, 0), {0, 0.01}},
          {"flicker", [flicker](test::NormalPairs& normal) { return flicker(normal); }, strengths(0, 0, 1, 0, 0), {0}},
          {"walk", walk, strengths(0, 0, 0, 1, 0), {0}},
          {"ramp", ramp, strengths(0, 1, 0, 0, 0.0025), {0, 0.01}},
          // Before, a walk was taken for a ramp in one record in six, and the last points held the truth in 61 %.
          {"white and walk", sum, strengths(0, 1, 0, 3e-3, 0), {0}}};
}

AllanCurve octaves(const std::vector<double>& rate) {
  return allan_deviation(rate, 1, allan_cluster_sizes(AllanGrid::kOctave, rate.size()), AllanEstimator::kOverlapping,
                         "x")
      .value();
}

/// Adds 1 for each coefficient whose interval holds the truth, also if that is 0; R: only if it has a truth.
void add_covered(const AllanCoefficients& found, const NoiseSquares& truth, std::array<int, kNoiseTypes>& counts) {
  const double h = 3600;
  const std::array<double, kNoiseTypes> scale = {1, std::sqrt(1 / h), 1 / kAllanFlicker, std::sqrt(h), h};
  for (std::size_t k = 0; k < kNoiseTypes; ++k) {
    const double value = std::sqrt(truth(static_cast<Eigen::Index>(k))) * scale[k];
    counts[k] += found.at_least[k] <= value && value <= found.at_most[k];
  }
}

TEST(AllanCoverage, OfEveryPointAndCoefficientWithAndWithoutLostValues) {
  constexpr int kSeries = 100;
  for (const Process& process : processes()) {
    for (const double lost : process.lost) {
      std::vector<int> inside(9, 0);
      std::array<int, kNoiseTypes> coefficients{};
      for (std::uint64_t seed = 0; seed < kSeries; ++seed) {
        test::NormalPairs normal(5000 + seed);
        std::vector<double> rate = process.make(normal);
        for (double& value : rate) {
          if (lost > 0 && normal.uniform() < lost) value = std::numeric_limits<double>::quiet_NaN();
        }
        const AllanCurve curve = octaves(rate);
        ASSERT_EQ(curve.points.size(), 9u) << process.name << ", lost " << lost;
        const AllanModel model = AllanModel::fit(curve, "x").value();
        const auto intervals = allan_confidence(curve, model, kProbability);
        for (std::size_t i = 0; i < 9; ++i) {
          const double m = static_cast<double>(curve.points[i].m);
          const double truth = std::sqrt(unit_variances(m).dot(process.strengths));
          inside[i] += intervals[i].low <= truth && truth <= intervals[i].high;
        }
        add_covered(extract_coefficients(curve, model, kProbability, "x").value(), process.strengths, coefficients);
      }
      // Three standard deviations of 100 series.
      for (std::size_t i = 0; i < 9; ++i)
        EXPECT_NEAR(inside[i] / double{kSeries}, kProbability, 0.14) << process.name << ", lost " << lost << ", " << i;
      for (std::size_t k = 0; k < kNoiseTypes; ++k) {
        if (k + 1 == kNoiseTypes && process.strengths(4) == 0) continue;
        EXPECT_NEAR(coefficients[k] / double{kSeries}, kProbability, 0.16)
            << process.name << ", lost " << lost << ", " << k;
      }
    }
  }
}

std::vector<double> with_lost(std::vector<double> rate, double share, test::NormalPairs& normal) {
  for (double& value : rate) {
    if (normal.uniform() < share) value = std::numeric_limits<double>::quiet_NaN();
  }
  return rate;
}

// 1 % of lost rows. Before, the angle errors at a lost row were not part of the model: of quantised rates the points of
// 8 values and more held the truth in 48 to 0.5 % of the records; and pairs without a lost row are a blurred measure of
// a steep ramp: 47.5 % at 4 values.
TEST(AllanCoverage, OfQuantisationAndASteepRampWithLostValues) {
  constexpr int kSeries = 100;
  const auto count = [](const NoiseSquares& truth, auto&& make) {
    std::vector<int> inside(9, 0);
    for (std::uint64_t seed = 0; seed < kSeries; ++seed) {
      test::NormalPairs normal(7000 + seed);
      const AllanCurve curve = octaves(with_lost(make(normal), 0.01, normal));
      const auto intervals = allan_confidence(curve, AllanModel::fit(curve, "x").value(), kProbability);
      for (std::size_t i = 0; i < 9; ++i) {
        const double deviation = std::sqrt(unit_variances(static_cast<double>(curve.points[i].m)).dot(truth));
        inside[i] += intervals[i].determined && intervals[i].low <= deviation && deviation <= intervals[i].high;
      }
    }
    return inside;
  };
  const auto quantised = [](test::NormalPairs& normal) { return test::quantised_angle(kValues, normal); };
  const auto ramp = [](test::NormalPairs& normal) {
    std::vector<double> rate(kValues);
    for (std::size_t i = 0; i < kValues; ++i) rate[i] = normal() + static_cast<double>(i);
    return rate;
  };
  for (const std::vector<int>& inside :
       {count(strengths(1, 0, 0, 0, 0), quantised), count(strengths(0, 1, 0, 0, 1), ramp)}) {
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(inside[i] / double{kSeries}, kProbability, 0.14) << i;
  }
}

TEST(AllanCoverage, TheEffectOfLostValuesOnQuantisationIsExpected) {
  constexpr int kSeries = 200;
  std::vector<double> shown(9, 0), expected(9, 0);
  for (std::uint64_t seed = 0; seed < kSeries; ++seed) {
    test::NormalPairs normal(8000 + seed);
    const AllanCurve curve = octaves(with_lost(test::quantised_angle(kValues, normal), 0.02, normal));
    for (std::size_t i = 0; i < 9; ++i) {
      shown[i] += std::pow(curve.points[i].deviation, 2) / kSeries;
      expected[i] += expected_variances(curve.points[i])(0) / kSeries;
    }
  }
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(shown[i] / expected[i], 1, 0.02 + 0.01 * static_cast<double>(i)) << i;
}

// All pairs over a gap share its errors, and few gaps have most of them. Before, the stated variance was half of the
// true one from 128 values on, and where missing values dominate, every tenth point was determined: that with the
// largest error.
TEST(AllanCoverage, TheSpreadOfFewLostValuesIsExpected) {
  constexpr int kSeries = 100;
  constexpr std::size_t kFirst = 5, kLast = 10;  // 32 to 1024 values
  const NoiseSquares truth = strengths(1, 0, 0, 0, 0);
  std::vector<double> found(kLast + 1, 0), expected(kLast + 1, 0);
  int determined = 0;
  for (std::uint64_t seed = 0; seed < kSeries; ++seed) {
    test::NormalPairs normal(9000 + seed);
    const AllanCurve curve = octaves(with_lost(test::quantised_angle(8000, normal), 0.01, normal));
    const CurveCovariance covariance(curve);
    for (std::size_t i = kFirst; i <= kLast; ++i) {
      const double mean = expected_variances(curve.points[i]).dot(truth);
      found[i] += std::pow(std::pow(curve.points[i].deviation, 2) / mean - 1, 2);
      expected[i] += truth.dot(covariance(i, i) * truth) / (mean * mean);
    }
    determined += allan_confidence(curve, AllanModel::fit(curve, "x").value(), kProbability).back().determined;
  }
  for (std::size_t i = kFirst; i <= kLast; ++i) EXPECT_NEAR(found[i] / expected[i], 1, 0.45) << i;
  EXPECT_LE(determined, 3);  // before: 35
}

// Quantisation at long times: the point would be what is left of the noise at the gaps.
TEST(AllanCoverage, APointThatLostValuesDominateIsNotDetermined) {
  test::NormalPairs normal(1);
  const auto curve = octaves(with_lost(test::quantised_angle(20000, normal), 0.1, normal));
  const auto intervals = allan_confidence(curve, AllanModel::fit(curve, "x").value(), kProbability);
  EXPECT_TRUE(intervals.front().determined);
  EXPECT_FALSE(intervals.back().determined);
}

TEST(AllanCoverage, NoSlowNoiseIsFoundInFlickerAndWhiteNoise) {
  constexpr int kRecords = 40;
  const test::Flicker noise(2048);
  for (const double flicker : {0.0, 0.3, 3.0}) {
    int walks = 0, ramps = 0;
    for (std::uint64_t seed = 0; seed < kRecords; ++seed) {
      test::NormalPairs normal(9000 + seed);
      std::vector<double> rate = noise(normal);
      for (double& value : rate) value = flicker * value + normal();
      const AllanCurve curve = octaves(rate);
      const AllanCoefficients found =
          extract_coefficients(curve, AllanModel::fit(curve, "x").value(), kProbability, "x").value();
      walks += found.rate_random_walk_deg_per_h_sqrt_h.has_value();
      ramps += found.rate_ramp_deg_per_h_h.has_value();
    }
    EXPECT_LE(walks, 2) << flicker;
    EXPECT_LE(ramps, 2) << flicker;
  }
}

// White noise below a strong walk. In the test Q may be slightly negative, in the best fit it may not: the best N is
// often just below the interval. Before, the interval was widened to it, and held the truth in 75 to 77 % of 1 000
// records.
TEST(AllanCoverage, AnIntervalIsNotWidenedToTheBestFit) {
  constexpr int kSeries = 100;
  int inside = 0, without_best = 0;
  for (std::uint64_t seed = 0; seed < kSeries; ++seed) {
    test::NormalPairs normal(11000 + seed);
    std::vector<double> rate = test::averaged_walk(kValues, normal);
    for (double& value : rate) value = std::sqrt(0.3) * value + normal();
    const AllanCurve curve = octaves(rate);
    const AllanModel model = AllanModel::fit(curve, "x").value();
    const auto interval = strength_interval(model, NoiseType::kAngleRandomWalk, kProbability);
    inside += interval.low <= 1 && 1 <= interval.high;
    const double best = model.best()(1);
    without_best += best > 0 && (best < interval.low || best > interval.high);
    const auto found = extract_coefficients(curve, model, kProbability, "x")->angle_random_walk_deg_per_sqrt_h;
    if (!found) continue;
    EXPECT_LE(found->low, found->value) << seed;
    EXPECT_LE(found->value, found->high) << seed;
  }
  EXPECT_GT(without_best, 0);
  EXPECT_NEAR(inside / double{kSeries}, kProbability, 0.14);  // 3 sigma
}

// A ramp in noise of all four kinds. If the fit has B without K, the standard deviation of the slope lacks the walk:
// before, the intervals of these records held the truth in 46 %.
TEST(AllanCoverage, ARampBesideFlickerWithoutAWalkIsNotDetermined) {
  constexpr int kSeries = 100;
  const double slope = std::sqrt(3e-4);
  const test::Flicker flicker(kValues);
  int given = 0, inside = 0, hidden = 0;
  for (std::uint64_t seed = 0; seed < kSeries; ++seed) {
    test::NormalPairs normal(12000 + seed);
    std::vector<double> rate = flicker(normal);
    const std::vector<double> walk = test::averaged_walk(kValues, normal),
                              angle = test::quantised_angle(kValues, normal);
    for (std::size_t i = 0; i < kValues; ++i) {
      rate[i] = std::sqrt(0.06) * rate[i] + std::sqrt(1e-3) * walk[i] + std::sqrt(3.0) * angle[i] + normal() +
                slope * static_cast<double>(i);
    }
    const AllanCurve curve = octaves(rate);
    const AllanModel model = AllanModel::fit(curve, "x").value();
    const auto ramp = extract_coefficients(curve, model, kProbability, "x")->rate_ramp_deg_per_h_h;
    const bool without_walk = model.noise()(2) > 0 && model.noise()(3) == 0;
    hidden += model.ramp_is_certain() && without_walk;
    if (!ramp) continue;
    EXPECT_FALSE(without_walk) << seed;
    ++given;
    inside += ramp->low <= 3600 * slope && 3600 * slope <= ramp->high;
  }
  EXPECT_GT(hidden, 0);
  EXPECT_GT(given, 30);
  EXPECT_NEAR(inside / static_cast<double>(given), kProbability, 0.2);  // 3 sigma of 50
}

// White noise and a random walk whose other points show hardly any walk. Before, the slope of each of these records was
// a certain ramp (3 of 2 000 records): it exceeded four standard deviations with the largest K of one sigma, but a K
// of two sigma explained it.
TEST(AllanCoverage, AWalkThatTheOtherPointsHideIsNoRamp) {
  for (const std::uint64_t seed : {5463, 5606, 6077}) {
    test::NormalPairs normal(seed);
    std::vector<double> rate(kValues);
    for (double& value : rate) value = normal();
    const std::vector<double> slow = test::averaged_walk(kValues, normal);
    for (std::size_t i = 0; i < kValues; ++i) rate[i] += std::sqrt(3e-3) * slow[i];
    const AllanModel model = AllanModel::fit(octaves(rate), "x").value();
    EXPECT_GT(std::abs(model.slope()), 4 * model.slope_sd()) << seed;
    EXPECT_FALSE(model.ramp_is_certain()) << seed;
  }
}

// Samples of a walk instead of averages of it. Its Allan variance is k (2m² + 1) / (6m).
TEST(AllanCoverage, OfASampledWalkBelowWhiteNoise) {
  int found = 0, inside = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    std::vector<double> rate = test::white_noise(4096, 1, 50000 + seed);
    const std::vector<double> slow = test::random_walk(4096, 0.03, 60000 + seed);
    for (std::size_t i = 0; i < rate.size(); ++i) rate[i] += slow[i];
    const AllanCurve curve = octaves(rate);
    const auto k = extract_coefficients(curve, AllanModel::fit(curve, "x").value(), kProbability, "x")
                       .value()
                       .rate_random_walk_deg_per_h_sqrt_h;
    if (!k) continue;
    ++found;
    inside += k->low <= 1.8 && 1.8 <= k->high;  // 0.03 · √3600
  }
  EXPECT_GE(found, 30);
  EXPECT_NEAR(inside / static_cast<double>(found), kProbability, 0.22);  // 3 sigma of 40
}

}  // namespace
}  // namespace prism::evaluation
