// SPDX-License-Identifier: MIT
// Allan deviations compared with NIST SP 1065 (2008), section 12, and coefficients with a second program.
#include "compensation/evaluation/allan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <numeric>
#include <sstream>

#include "compensation/evaluation/allan_fit.hpp"
#include "tests/support/power_law_noise.hpp"
#include "tests/support/random_series.hpp"
#include "tests/support/scripts.hpp"

namespace prism::evaluation {
namespace {

using testing::HasSubstr;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

AllanAnalysis analyse(const std::vector<double>& rate) { return analyse_allan(rate, 1, "x").value(); }

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

TEST(Allan, MatchesTheStandardsNineFrequencies) {
  const std::vector<double> nine = {892, 809, 823, 798, 671, 644, 883, 903, 677};
  EXPECT_EQ(fmt::format("{:.5f}", allan_deviation(nine, 1)), "91.22945");
  EXPECT_EQ(fmt::format("{:.5f}", allan_deviation(nine, 2)), "85.95287");
}

TEST(Allan, MatchesTheStandardsThousandFrequencies) {
  std::vector<std::string> printed;
  for (const std::size_t m : {1, 10, 100})
    printed.push_back(fmt::format("{:.6e}", allan_deviation(thousand_frequencies(), m)));
  EXPECT_EQ(printed, (std::vector<std::string>{"2.922319e-01", "9.159953e-02", "3.241343e-02"}));
}

TEST(Allan, UsesTheStandardsDegreesOfFreedom) {
  // Section 12: 1 000 frequencies of white noise, m = 10. Elsewhere table 5, computed by hand.
  EXPECT_NEAR(allan_edf(1000, 10, {0, 1, 0, 0}), 146.177, 0.001);
  EXPECT_NEAR(allan_edf(1000, 10, {1, 0, 0, 0}), 1002.0 * 981 / (2 * 991), 1e-6);
  EXPECT_NEAR(allan_edf(1000, 10, {0, 0, 1, 0}), 5.0 * 1001 * 1001 / (40 * 1031), 1e-6);
  EXPECT_NEAR(allan_edf(1000, 100, {0, 0, 0, 1}), 9.99 * (1e6 - 3e5 + 4e4) / (998.0 * 998), 1e-6);
}

/// The definition: the means of the values that are there, 95 % of them or more. The sum is of its squared differences.
std::pair<double, std::size_t> slow(const std::vector<double>& y, std::size_t m) {
  double sum = 0;
  std::size_t windows = 0;
  for (std::size_t j = 0; j + 2 * m <= y.size(); ++j) {
    double means[2] = {}, counts[2] = {};
    for (std::size_t i = 0; i < 2 * m; ++i) {
      if (std::isfinite(y[j + i])) means[i / m] += y[j + i], ++counts[i / m];
    }
    const double size = static_cast<double>(m);
    if (std::min(counts[0], counts[1]) < 0.95 * size - 1e-9) continue;
    const double d = means[1] / counts[1] - means[0] / counts[0];
    sum += d * d * 2 / (size / counts[0] + size / counts[1]);
    ++windows;
  }
  return {std::sqrt(sum / (2 * static_cast<double>(windows))), windows};
}

TEST(Allan, EqualsItsDefinitionWithAndWithoutMissingValues) {
  std::vector<double> rate = test::random_walk(157, 1, 2);
  for (std::size_t m = 1; 2 * m <= rate.size(); ++m)
    EXPECT_NEAR(allan_deviation(rate, m), slow(rate, m).first, 1e-12 * slow(rate, m).first) << m;
  rate = test::with_gaps(test::white_noise(2000, 1, 8), 40);
  rate[1000] = rate[1001] = rate[1002] = rate[1003] = kUnknown;
  const AllanAnalysis found = analyse(rate);
  EXPECT_EQ(found.missing, 44u);
  EXPECT_EQ(found.holes, 41u);
  EXPECT_EQ(found.values, 1956u);
  ASSERT_EQ(found.points.size(), 8u);
  for (const AllanPoint& point : found.points) {
    const auto [deviation, windows] = slow(rate, point.m);
    EXPECT_NEAR(point.deviation, deviation, 1e-4 * deviation) << point.m;  // the line through the series differs
    EXPECT_EQ(point.windows, windows) << point.m;
  }
  // The degrees of freedom fall with the pairs that do not count.
  const AllanAnalysis whole = analyse(test::white_noise(2000, 1, 8));
  EXPECT_NEAR(found.points[3].edf / whole.points[3].edf, static_cast<double>(found.points[3].windows) / 1985, 0.05);
}

/// Sines of squares: without memory, and the same everywhere.
std::vector<double> sines(std::size_t values) {
  std::vector<double> rate;
  for (std::size_t i = 0; i < values; ++i) rate.push_back(std::sin(static_cast<double>(i * i)));
  return rate;
}

// By a script that computes the means of all pairs of clusters, and the edf of white noise by table 5 of SP 1065. An
// edf counts from 2 for a random walk: 3.5 for 8 values; the second of 16 has 3.7.
TEST(Allan, APointHasItsIntervalAndDegreesOfFreedom) {
  std::vector<double> hole = sines(24);
  hole[5] = kUnknown;
  struct Case {
    std::vector<double> rate;
    std::vector<AllanPoint> points;
  };
  for (const Case& c : {Case{sines(8), {{1, 10, 0.648251248976, 0.511622531977, 1.03227172342, 4.64197530864, 7}}},
                        {sines(16),
                         {{1, 10, 0.859865583806, 0.718246597574, 1.14217706534, 9.88235294118, 15},
                          {2, 20, 0.429711207773, 0.352891492583, 0.59751695934, 7.79831932773, 13}}},
                        {sines(24),
                         {{1, 10, 0.797448540827, 0.685276646345, 0.992306797781, 15.1822222222, 23},
                          {2, 20, 0.439831436301, 0.372920972438, 0.563631524453, 12.3123809524, 21}}},
                        {hole,
                         {{1, 10, 0.823605615664, 0.703708838806, 1.03747577873, 13.8620289855, 21},
                          {2, 20, 0.449021461305, 0.37529175532, 0.595547454095, 9.96716553288, 17}}}}) {
    const AllanAnalysis found = analyse_allan(c.rate, 10, "x").value();
    ASSERT_EQ(found.points.size(), c.points.size());
    for (std::size_t i = 0; i < c.points.size(); ++i) {
      const AllanPoint &a = found.points[i], &b = c.points[i];
      SCOPED_TRACE(fmt::format("{} values, m {}", c.rate.size(), b.m));
      EXPECT_EQ(a.m, b.m);
      EXPECT_EQ(a.tau_s, b.tau_s);
      EXPECT_EQ(a.windows, b.windows);
      EXPECT_NEAR(a.deviation, b.deviation, 1e-10);
      EXPECT_NEAR(a.low, b.low, 1e-10);
      EXPECT_NEAR(a.high, b.high, 1e-10);
      EXPECT_NEAR(a.edf, b.edf, 1e-9);
      EXPECT_EQ(a.noise, NoiseType::kAngleRandomWalk);
    }
    EXPECT_EQ(found.tau0_s, 10);
    EXPECT_EQ(found.minimum().m, c.points.back().m);
    EXPECT_EQ(found.coefficients.error().text(), fmt::format("x: found {}, expected 3 or more: 32 values",
                                                             c.points.size() == 1 ? "1 octave" : "2 octaves"));
  }
  EXPECT_TRUE(analyse(sines(32)).coefficients) << "three octaves";
}

// 19 of 20 values of each cluster are enough, 18 are not.
TEST(Allan, AClusterNeedsNineteenOfTwentyValues) {
  for (const std::size_t lost : {1u, 2u}) {
    std::vector<double> rate = sines(40);
    for (std::size_t i = 0; i < lost; ++i) rate[3 + 2 * i] = rate[21 + 3 * i] = kUnknown;
    EXPECT_EQ(slow(rate, 20).second, lost == 1 ? 1u : 0u);
    const double found = allan_deviation(rate, 20);
    EXPECT_NEAR(found, lost == 1 ? slow(rate, 20).first : 0, 2e-3) << lost;  // the line through the series differs
    EXPECT_EQ(found > 0, lost == 1);
  }
}

TEST(Allan, KeepsPrecisionWithAnEarthRate) {
  std::vector<double> rate = test::white_noise(100000, 1e-3, 4), lifted = rate;
  for (double& value : lifted) value += 15.0;
  for (const std::size_t m : {1, 1000}) EXPECT_NEAR(allan_deviation(lifted, m) / allan_deviation(rate, m), 1, 1e-8);
}

TEST(Allan, PoolsTheRecordsBetweenBreaks) {
  // Two records with different levels: a pair across the break would include the step of 100.
  std::vector<double> rate = test::white_noise(4000, 1, 7);
  for (std::size_t i = 2000; i < 4000; ++i) rate[i] += 100;
  rate[2000] = kAllanBreak;
  const AllanAnalysis found = analyse(rate);
  EXPECT_EQ(found.holes, 1u);
  EXPECT_EQ(found.missing, 0u);
  EXPECT_EQ(found.values, 3999u);
  EXPECT_NEAR(found.points[0].deviation, 1, 0.08);
  EXPECT_NEAR(found.points[3].deviation, std::sqrt(0.125), 0.05);
  EXPECT_FALSE(coefficient(*found.coefficients, NoiseType::kRateRandomWalk).value);
}

/// allan_reference.py has the same lines.
std::vector<double> reference_series(std::size_t values, std::uint64_t seed, const std::vector<double>& strength) {
  std::uint64_t n = 1234567890 + seed;
  const auto normal = [&] {
    std::uint64_t total = 0;
    for (int i = 0; i < 12; ++i) total += n = 16807 * n % 2147483647;
    return static_cast<double>(total) / 2147483647.0 - 6;
  };
  std::vector<double> y;
  double walk = 0, before = 0, processes[6] = {};
  for (std::size_t i = 0; i < values; ++i) {
    const double error = normal();
    double rate = std::sqrt(strength[0]) * (error - before) + std::sqrt(strength[1]) * normal() +
                  strength[4] * static_cast<double>(i);
    before = error;
    rate += walk += std::sqrt(strength[3]) * normal();
    double rest = 0.5;
    for (double& process : processes) {
      rate += process = (1 - rest) * process + std::sqrt(strength[2] * rest) * normal();
      rest /= 4;
    }
    y.push_back(rate);
  }
  return y;
}

// The reference stops its fit at 1e-3 and its bisection after six steps.
TEST(Allan, CoefficientsAreThoseOfTheReference) {
  std::ifstream file(std::string(PRISM_SOURCE_DIR) + "/tests/unit/evaluation/allan_reference.txt");
  int series = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    std::size_t values = 0;
    std::uint64_t seed = 0;
    std::vector<double> strength(5);
    words >> values >> seed;
    for (double& each : strength) words >> each;
    // With a sample of an hour, the units of the coefficients are those of the strengths but for these.
    const double unit[] = {3600, 1, 1 / std::sqrt(kFlicker), 1, 1};
    const AllanAnalysis found = analyse_allan(reference_series(values, seed, strength), 3600, "x").value();
    for (std::size_t k = 0; k < kNoiseTypes; ++k) {
      const AllanCoefficient& c = (*found.coefficients)[k];
      const auto in_strengths = [&](double x) { return k == 4 ? x : x * x / (unit[k] * unit[k]); };
      std::string value;
      double low = 0, high = 0;
      words >> value >> low >> high;
      const std::string what = fmt::format("{} values, seed {}, {}", values, seed, "QNBKR"[k]);
      ASSERT_EQ(value != "-", c.value.has_value()) << what;
      if (c.value) {
        EXPECT_NEAR(in_strengths(*c.value) / std::stod(value), 1, 0.002) << what;
        EXPECT_NEAR(in_strengths(c.low) / low, 1, 0.01) << what;
      }
      EXPECT_NEAR(in_strengths(c.high) / high, 1, 0.01) << what;
    }
    ASSERT_TRUE(words) << line;
    ++series;
  }
  EXPECT_EQ(series, 20);
}

// sigma² = 3 Q²/tau² + N²/tau_h + B² 2 ln 2/pi + K² tau_h/3 + R² tau_h²/2, so that with samples of 36 s instead of an
// hour the coefficients of the same numbers change by these factors.
TEST(Allan, CoefficientsHaveTheUnitsOfTheStandard) {
  const double factor[] = {0.01, 0.1, 1, 10, 100};
  const std::pair<std::size_t, std::vector<double>> series[] = {
      {5000, {3, 1, 0.02, 3e-5, 0}}, {1000, {0, 0, 1, 0, 0}}, {8000, {0, 1, 0, 1e-6, 1e-4}}};
  for (const auto& [values, strength] : series) {
    const std::vector<double> rate = reference_series(values, 15, strength);
    const AllanAnalysis hours = analyse_allan(rate, 3600, "x").value(), seconds = analyse_allan(rate, 36, "x").value();
    for (std::size_t k = 0; k < kNoiseTypes; ++k) {
      const AllanCoefficient &a = (*hours.coefficients)[k], &b = (*seconds.coefficients)[k];
      ASSERT_EQ(a.value.has_value(), b.value.has_value());
      EXPECT_NEAR(b.value.value_or(0), factor[k] * a.value.value_or(0), 1e-9 * factor[k] * a.high);
      EXPECT_NEAR(b.low, factor[k] * a.low, 1e-9 * factor[k] * a.high);
      EXPECT_NEAR(b.high, factor[k] * a.high, 1e-9 * factor[k] * a.high);
    }
  }
}

/// series VALUES SEED Q N B K SLOPE: as in allan_reference.txt; lose FIRST COUNT; analyse TAU0_S.
class AllanPlayer {
 public:
  std::vector<std::string> play(const std::string& command, std::istream& words) {
    using test::next;
    if (command == "series") {
      const auto values = next<std::size_t>(words);
      const auto seed = next<std::uint64_t>(words);
      std::vector<double> strength(5);
      for (double& each : strength) words >> each;
      rate_ = reference_series(values, seed, strength);
      return {};
    }
    if (command == "lose") {
      const auto first = next<std::size_t>(words);
      std::fill_n(rate_.begin() + static_cast<std::ptrdiff_t>(first), next<int>(words), kUnknown);
      return {};
    }
    const AllanAnalysis found = analyse_allan(rate_, next<double>(words), "x").value();
    std::vector<std::string> lines;
    for (const AllanPoint& p : found.points)
      lines.push_back(fmt::format("{:g} s: {:.5g}, {:.5g} to {:.5g}, edf {:.5g} of {}, {}", p.tau_s, p.deviation, p.low,
                                  p.high, p.edf, p.windows, "QNBKR"[static_cast<std::size_t>(p.noise)]));
    for (std::size_t k = 0; k < kNoiseTypes; ++k) {
      const AllanCoefficient& c = (*found.coefficients)[k];
      lines.push_back(c.value ? fmt::format("{} {:.5g}, {:.5g} to {:.5g}", "QNBKR"[k], *c.value, c.low, c.high)
                              : fmt::format("{} at most {:.5g}", "QNBKR"[k], c.high));
    }
    if (!found.unexplained_s.empty())
      lines.push_back(fmt::format("unexplained: {}", fmt::join(found.unexplained_s, " ")));
    return lines;
  }

 private:
  std::vector<double> rate_;
};

// Recorded: allan_reference.txt has the coefficients of such series by another program, within one per cent.
TEST(Allan, Scripts) { test::expect_scripts<AllanPlayer>("evaluation/allan.txt"); }

TEST(Allan, APointNamesTheNoiseWithTheLargestPart) {
  const auto names = [](const std::vector<double>& strength) {
    std::string text;
    for (const AllanPoint& point : analyse(reference_series(1000, 7, strength)).points)
      text += "QNBKR"[static_cast<std::size_t>(point.noise)];
    return text;
  };
  EXPECT_EQ(names({1, 0, 0, 0, 0}), "QQQQQQQ");
  EXPECT_EQ(names({0, 1, 0, 0, 0}), "NNNNNNN");
  EXPECT_EQ(names({0, 0, 0, 1, 0}), "KKKKKKK");
  EXPECT_EQ(names({0, 0, 0, 0.01, 1}).back(), 'R');
  std::string all;
  for (int type = 0; type < 5; ++type) all += noise_type_text(static_cast<NoiseType>(type)) + std::string(", ");
  EXPECT_EQ(all, "quantisation, angle random walk, bias instability, rate random walk, rate ramp, ");
}

// The reference fails: with nine octaves of a walk its correlations are not a covariance.
TEST(Allan, FindsAWalkOfManyOctaves) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const AllanAnalysis found = analyse(test::random_walk(20000, 1, seed));
    EXPECT_NEAR(coefficient(*found.coefficients, NoiseType::kRateRandomWalk).value.value_or(0), 60, 6) << seed;
    EXPECT_TRUE(found.unexplained_s.empty()) << seed;
  }
}

TEST(Allan, AnOscillationIsNoneOfTheFiveNoises) {
  std::vector<double> rate = test::white_noise(20000, 1, 26);
  EXPECT_TRUE(analyse(rate).unexplained_s.empty());
  for (std::size_t i = 0; i < rate.size(); ++i) rate[i] += std::sin(2 * std::numbers::pi * static_cast<double>(i) / 40);
  const std::vector<double> at = analyse(rate).unexplained_s;
  EXPECT_THAT(at, testing::Contains(16));  // the Allan deviation of a line is largest at 0.37 of its period
  std::vector<double> drive = test::white_noise(200000, 0.14, 27), noise = test::white_noise(200000, 0.1, 28);
  double state = 0;
  for (std::size_t i = 0; i < noise.size(); ++i) noise[i] += state = 0.99 * state + drive[i];
  EXPECT_FALSE(analyse(noise).unexplained_s.empty());
}

TEST(Allan, RefusesWhatItCannotMeasure) {
  const auto refused = [](const std::vector<double>& rate, double tau0_s = 1) {
    return analyse_allan(rate, tau0_s, "log.csv").error().text();
  };
  EXPECT_EQ(refused({}), "log.csv: found 0 values with 0 gaps, expected at least 8 without a gap");
  const std::vector<double> noise = test::white_noise(100, 1, 1);
  EXPECT_THAT(refused(noise, 0), HasSubstr("found a sample interval of 0 s"));
  EXPECT_THAT(refused(noise, kUnknown), HasSubstr("expected a positive number"));
  EXPECT_THAT(refused(std::vector<double>(100, 0.1)), HasSubstr("found an Allan deviation of 0"));
  std::vector<double> ridden = noise;
  for (std::size_t i = 0; i < ridden.size(); i += 2) ridden[i] = kUnknown;
  EXPECT_THAT(refused(ridden), HasSubstr("found 50 values with 50 gaps"));
  std::vector<double> line(2000);
  std::iota(line.begin(), line.end(), 0.0);
  EXPECT_THAT(analyse(line).coefficients.error().text(), HasSubstr("x: the rate is a straight line"));
}

// Before, `prismcal evaluate` ended with an exception of Boost on a log of a few 2 s blocks.
TEST(Allan, ShortSeriesHaveFiniteBoundsOrNoCoefficient) {
  for (std::size_t values = 1; values < 80; ++values) {
    for (std::uint64_t seed = 1; seed < 9; ++seed) {
      std::vector<double> rate =
          seed % 2 == 0 ? test::random_walk(values, 1e-9, seed) : test::white_noise(values, 1e6, seed);
      if (seed % 3 == 0 && values > 4) rate = test::with_gaps(rate, 1);
      if (seed > 4) {
        for (double& value : rate) value = std::isfinite(value) ? std::round(value) : value;
      }
      const auto found = analyse_allan(rate, 1, "x");
      ASSERT_TRUE(values >= 8 || !found);
      if (!found) continue;
      EXPECT_EQ(found->coefficients.has_value(), found->points.size() >= 3) << values;
      if (!found->coefficients) continue;
      for (const AllanCoefficient& each : *found->coefficients) {
        EXPECT_TRUE(std::isfinite(each.high) && each.high >= each.low) << values << " " << seed;
        EXPECT_TRUE(!each.value || (each.low <= *each.value && *each.value <= each.high)) << values << " " << seed;
      }
    }
  }
}

TEST(Allan, ShowsTheWhiteNoiseInOtherDefinitions) {
  EXPECT_NEAR(matlab_rad_per_s_per_sqrt_hz(0.06), 1.745329e-5, 1e-11);  // 0.001 deg/sqrt(s)
  EXPECT_NEAR(one_sided_deg_per_s_per_sqrt_hz(0.06), 1.414214e-3, 1e-9);
}

// How often the intervals hold the truth, on few short series; `tools/bench allan-coverage` has 300 of every noise.
// White noise of 1, quantisation of 0.3 and a walk, without and with missing values.
TEST(AllanCoverage, IntervalsAndBoundsHoldTheTruth) {
  constexpr int kSeries = 150, kValues = 2000;
  const double truth[] = {std::sqrt(0.3), 1 / 60.0, 0, std::sqrt(3e-3) * 60, 0};
  for (const bool missing : {false, true}) {
    int given[kNoiseTypes] = {}, held[kNoiseTypes] = {}, bounded[kNoiseTypes] = {}, unexplained = 0;
    for (std::uint64_t seed = 0; seed < kSeries; ++seed) {
      test::NormalPairs normal(5000 + seed);
      const auto angle = test::quantised_angle(kValues, normal), walk = test::averaged_walk(kValues, normal);
      std::vector<double> rate(kValues);
      for (std::size_t i = 0; i < kValues; ++i) {
        rate[i] = std::sqrt(0.3) * angle[i] + normal() + std::sqrt(3e-3) * walk[i];
        if (missing && (normal.uniform() < 0.01 || (i >= 900 && i < 1100))) rate[i] = std::nan("");
      }
      const AllanAnalysis found = analyse_allan(rate, 1, "x").value();
      unexplained += !found.unexplained_s.empty();
      for (std::size_t k = 0; k < kNoiseTypes; ++k) {
        const AllanCoefficient& each = (*found.coefficients)[k];
        given[k] += each.value.has_value();
        (each.value ? held : bounded)[k] += each.low <= truth[k] && truth[k] <= each.high;
      }
    }
    // Three standard deviations of 150 series around 68 %; the walk is found in most series and may be a little large.
    for (const std::size_t k : {0u, 1u, 3u}) {
      EXPECT_GE(given[k], 0.5 * kSeries) << "QNBKR"[k];
      EXPECT_NEAR(held[k] / static_cast<double>(given[k]), 0.7, 0.12) << "QNBKR"[k] << missing;
    }
    EXPECT_LE(given[2], 8) << missing;
    EXPECT_LE(given[4], 8) << missing;
    EXPECT_EQ(bounded[2], kSeries - given[2]);
    EXPECT_LE(unexplained, 1);
  }
}

}  // namespace
}  // namespace prism::evaluation
