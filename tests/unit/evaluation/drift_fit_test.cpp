// SPDX-License-Identifier: MIT
// Sensitivities and warm-up of records whose truth is known; coverage: tools/bench report-coverage.
#include "compensation/evaluation/drift_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/power_law_noise.hpp"

namespace prism::evaluation {
namespace {

constexpr double kPerDegC = 4e-4, kAmplitude = 0.05, kTau_s = 3600, kWhite = 0.002;

/// `n` blocks of 100 s: a triangle of temperature, white noise, and a warm-up.
DriftRecord record(std::size_t n, double level, std::uint64_t seed, bool switched_on) {
  test::NormalPairs normal(seed);
  DriftRecord made{{}, {}, {{}, {}}, switched_on};
  for (std::size_t i = 0; i < n; ++i) {
    const double t = 100 * (static_cast<double>(i) + 0.5), phase = std::fmod(t, 20'000) / 20'000;
    const double temperature = 60 * (phase < 0.5 ? phase : 1 - phase);
    made.time_s.push_back(t);
    made.causes[0].push_back(temperature);
    made.causes[1].push_back(phase < 0.5 ? 0.18 : -0.18);
    made.bias_deg_per_h.push_back(level + kPerDegC * temperature + kWhite * normal() +
                                  (switched_on ? kAmplitude * std::exp(-t / kTau_s) : 0));
  }
  return made;
}

TEST(DriftFit, FindsTheSensitivityBesideLevelsAndAWarmUp) {
  const auto fit = fit_drift({record(400, 1, 11, true), record(300, 2, 12, false)}, 0.005).value();
  ASSERT_EQ(fit.causes.size(), 2u);
  EXPECT_NEAR(fit.causes[0].value, kPerDegC, 3e-5);
  EXPECT_LT(fit.causes[0].low, kPerDegC);
  EXPECT_GT(fit.causes[0].high, kPerDegC);
  EXPECT_LT(fit.causes[1].low, 0);
  EXPECT_GT(fit.causes[1].high, 0);
  ASSERT_TRUE(fit.warm_up_h);
  const double truth = kTau_s / 3600 * std::log(kAmplitude / 0.005);
  EXPECT_NEAR(fit.warm_up_h->value, truth, 0.2 * truth);
  EXPECT_LT(fit.warm_up_h->low, truth);
  EXPECT_GT(fit.warm_up_h->high, truth);
}

/// As drift_fit's reference, a script in numpy, has it.
DriftRecord waves(int n, int seed, bool switched_on, double level) {
  DriftRecord made{{}, {}, {{}, {}}, switched_on};
  for (int i = 0; i < n; ++i) {
    const double t = 100 * (i + 0.5), a = 10 * std::sin(i / 5.0 + seed), b = (i * 7 + seed) % 11;
    made.time_s.push_back(t);
    made.causes[0].push_back(a);
    made.causes[1].push_back(b);
    made.bias_deg_per_h.push_back(level + 0.02 * a - 0.003 * b + 0.05 * std::sin((i + seed) * (i + seed)) +
                                  0.04 * std::sin(0.3 * i) + (switched_on ? 0.6 * std::exp(-t / 600) : 0));
  }
  return made;
}

// The expected numbers are from covariance matrices and a level per record, without a filter (numpy).
TEST(DriftFit, IsGeneralisedLeastSquaresAveragedOverTheNoise) {
  const auto near = [](const Estimate& found, const Estimate& expected, double tolerance) {
    EXPECT_NEAR(found.value, expected.value, tolerance);
    EXPECT_NEAR(found.low, expected.low, tolerance);
    EXPECT_NEAR(found.high, expected.high, tolerance);
  };
  const auto two = fit_drift({waves(40, 1, true, 1), waves(30, 2, false, 2)}, 0.05).value();
  near(two.causes.at(0), {0.02183409602227723, 0.019242165251690473, 0.024426026792863986}, 1e-10);
  near(two.causes.at(1), {-0.0032989142831885833, -0.006249063051994239, -0.00034876551438292776}, 1e-10);
  ASSERT_TRUE(two.warm_up_h);
  near(*two.warm_up_h, {0.4369959086914933, 0.2828043155934691, 0.6774701801415891}, 1e-9);
  const auto one = fit_drift({waves(24, 3, false, 0)}, 0.05).value();
  near(one.causes.at(0), {0.01984079954283364, 0.01541308024328683, 0.024268518842380446}, 1e-10);
  near(one.causes.at(1), {-0.0055366238771214025, -0.010645657303610737, -0.0004275904506320684}, 1e-10);
  EXPECT_FALSE(one.warm_up_h);
}

// 20 blocks and a level for each record.
TEST(DriftFit, NeedsTwentyBlocksBesideTheLevels) {
  EXPECT_FALSE(fit_drift({waves(20, 1, false, 0)}, 0.05));
  EXPECT_TRUE(fit_drift({waves(21, 1, false, 0)}, 0.05));
  EXPECT_FALSE(fit_drift({waves(11, 1, false, 0), waves(10, 1, false, 0)}, 0.05));
  EXPECT_TRUE(fit_drift({waves(12, 1, false, 0), waves(10, 1, false, 0)}, 0.05));
  DriftRecord same = waves(30, 1, false, 0);
  same.causes[1] = same.causes[0];
  EXPECT_FALSE(fit_drift({same}, 0.05));
  same.causes.clear();
  EXPECT_TRUE(fit_drift({same}, 0.05)) << "nothing to fit";
  same.switched_on = true;
  EXPECT_TRUE(fit_drift({same}, 0.05));
}

TEST(DriftFit, NeedsASwitchOnForAWarmUp) {
  EXPECT_FALSE(fit_drift({record(300, 1, 3, false)}, 0.005).value().warm_up_h);
}

TEST(DriftFit, RejectsTooFewBlocksAndCausesThatChangeTogether) {
  EXPECT_FALSE(fit_drift({record(15, 1, 4, false)}, 0.005));
  DriftRecord same = record(100, 1, 5, false);
  same.causes[1] = same.causes[0];
  EXPECT_FALSE(fit_drift({same}, 0.005));
}

TEST(Intervals, AreThoseOfStudentAndChiSquare) {
  const std::vector<double> values = {1, 2, 3, 4};
  const Estimate mean = mean_with_interval(values), scatter = scatter_with_interval(values);
  EXPECT_NEAR(mean.high - mean.value, 3.182446 * 1.290994 / 2, 1e-5);  // t of 3 degrees of freedom
  EXPECT_NEAR(scatter.value, 1.290994, 1e-6);
  EXPECT_NEAR(scatter.low, 1.290994 * std::sqrt(3 / 9.348404), 1e-5);
  EXPECT_NEAR(scatter.high, 1.290994 * std::sqrt(3 / 0.215795), 1e-4);
}

}  // namespace
}  // namespace prism::evaluation
