// SPDX-License-Identifier: MIT
// Noise types, confidence and coefficients, for simulated noise of known strength.
#include <gtest/gtest.h>

#include <cmath>

#include "compensation/evaluation/allan_coefficients.hpp"
#include "tests/unit/evaluation/random_series.hpp"

namespace prism::evaluation {
namespace {

struct Analysis {
  AllanCurve curve;
  std::vector<AllanInterval> intervals;
  AllanCoefficients coefficients;
};

Analysis analyse(const std::vector<double>& rate, double tau0_s, double probability = 0.683) {
  const auto sizes = allan_cluster_sizes(AllanGrid::kOctave, rate.size());
  Analysis analysis;
  analysis.curve = allan_deviation(rate, tau0_s, sizes, AllanEstimator::kOverlapping, "test").value();
  analysis.intervals = allan_confidence(analysis.curve, rate, probability);
  analysis.coefficients = extract_coefficients(analysis.curve, analysis.intervals, "test").value();
  return analysis;
}

TEST(AllanConfidence, UsesTheStandardsDegreesOfFreedom) {
  // SP 1065 section 12: 1 000 frequencies of white frequency noise, m = 10: edf = 146.177.
  EXPECT_NEAR(degrees_of_freedom(NoiseType::kAngleRandomWalk, 1000, 10, AllanEstimator::kOverlapping), 146.177, 5e-4);
}

TEST(AllanConfidence, DistinguishesTheNoiseTypes) {
  const std::vector<double> white = test::white_noise(20000, 1, 11), walk = test::random_walk(20000, 1, 12);
  std::vector<double> steps = white;  // differences of white angle noise
  for (std::size_t i = steps.size() - 1; i > 0; --i) steps[i] -= steps[i - 1];
  const NoiseType none = NoiseType::kBiasInstability;
  EXPECT_EQ(identify_noise(white, 1, none), NoiseType::kAngleRandomWalk);
  EXPECT_EQ(identify_noise(white, 64, none), NoiseType::kAngleRandomWalk);
  EXPECT_EQ(identify_noise(walk, 1, none), NoiseType::kRateRandomWalk);
  EXPECT_EQ(identify_noise(steps, 1, none), NoiseType::kQuantisation);
  EXPECT_EQ(identify_noise(std::vector<double>(29, 1.0), 1, none), none);
}

TEST(AllanConfidence, CoversTheTruthWithItsNominalProbability) {
  int inside = 0, all = 0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    const std::vector<double> rate = test::white_noise(512, 1, 100 + seed);
    const std::vector<std::size_t> sizes = {16};
    const auto curve = allan_deviation(rate, 1, sizes, AllanEstimator::kOverlapping, "x").value();
    const auto interval = allan_confidence(curve, rate, 0.90).at(0);
    inside += interval.low <= 0.25 && 0.25 <= interval.high;
    ++all;
  }
  EXPECT_NEAR(static_cast<double>(inside) / all, 0.90, 0.05);  // 3 sigma of 400 trials is 0.045
}

TEST(AllanCoefficients, FindTheAngleRandomWalkOfWhiteNoise) {
  // 1 Hz means with sd s: N = s / 60 in deg/sqrt(h).
  const Analysis analysis = analyse(test::white_noise(100000, 0.072, 21), 1);
  ASSERT_TRUE(analysis.coefficients.angle_random_walk_deg_per_sqrt_h);
  EXPECT_NEAR(analysis.coefficients.angle_random_walk_deg_per_sqrt_h->value, 0.0012, 0.00002);
  EXPECT_FALSE(analysis.coefficients.bias_instability_deg_per_h);
  EXPECT_TRUE(analysis.coefficients.floor.edge_limited || analysis.coefficients.floor.clusters < 20);
}

TEST(AllanCoefficients, FindBothWalksAndNoPlateauBetweenThem) {
  // Rate random walk of 1e-4 deg/h per second: K = 1e-4 · 60 deg/h per sqrt(h); crossing near 1 200 s.
  std::vector<double> rate = test::white_noise(300000, 0.072, 22);
  const std::vector<double> walk = test::random_walk(300000, 1e-4, 23);
  for (std::size_t i = 0; i < rate.size(); ++i) rate[i] += walk[i];
  const Analysis analysis = analyse(rate, 1);
  ASSERT_TRUE(analysis.coefficients.rate_random_walk_deg_per_h_sqrt_h);
  EXPECT_NEAR(analysis.coefficients.angle_random_walk_deg_per_sqrt_h->value, 0.0012, 0.00003);
  EXPECT_NEAR(analysis.coefficients.rate_random_walk_deg_per_h_sqrt_h->value, 0.006, 0.0015);
  EXPECT_FALSE(analysis.coefficients.bias_instability_deg_per_h);
}

TEST(AllanCoefficients, FindARamp) {
  std::vector<double> rate = test::white_noise(50000, 0.072, 24);
  for (std::size_t i = 0; i < rate.size(); ++i) rate[i] += 0.5 * static_cast<double>(i) / 3600;  // 0.5 deg/h per h
  const Analysis analysis = analyse(rate, 1);
  ASSERT_TRUE(analysis.coefficients.rate_ramp_deg_per_h_h);
  EXPECT_NEAR(analysis.coefficients.rate_ramp_deg_per_h_h->value, 0.5, 0.02);
}

TEST(AllanCoefficients, FindQuantisation) {
  // The angle is quantised to q: white angle error of q / sqrt(12) arcsec at each end of each second.
  test::Normal normal(25);
  std::vector<double> rate(100000);
  double before = 0;
  for (double& value : rate) {
    const double error = 0.3 * normal();
    value = error - before;
    before = error;
  }
  const Analysis analysis = analyse(rate, 1);
  ASSERT_TRUE(analysis.coefficients.quantisation_arcsec);
  EXPECT_NEAR(analysis.coefficients.quantisation_arcsec->value, 0.3, 0.01);
}

TEST(AllanCoefficients, ReportAPlateauAsBiasInstability) {
  // Flicker noise as a sum of first-order processes an octave apart, 4 s to 16 384 s: a flat curve in between.
  std::vector<double> rate = test::white_noise(400000, 0.4, 26);
  for (int octave = 2; octave <= 16; ++octave) {
    const double decay = std::exp(-1 / std::ldexp(1.0, octave));
    const std::vector<double> drive = test::white_noise(rate.size(), 0.05 * std::sqrt(1 - decay * decay), 30 + octave);
    double state = 0;
    for (std::size_t i = 0; i < rate.size(); ++i) rate[i] += state = decay * state + drive[i];
  }
  const Analysis analysis = analyse(rate, 1);
  ASSERT_TRUE(analysis.coefficients.bias_instability_deg_per_h);
  // Variance v per unit of ln(time constant) gives S(f) = v / f, and so sigma^2 = 2 ln 2 v: here 2 * 0.05^2.
  const double truth = std::sqrt(2.0) * 0.05 / kAllanFlicker;
  EXPECT_NEAR(analysis.coefficients.bias_instability_deg_per_h->value, truth, 0.15 * truth);
}

TEST(AllanCoefficients, RejectAConstantAndAShortCurve) {
  const std::vector<double> constant(100, 1.0), few = {1, 2, 3, 5};
  for (const auto& rate : {constant, few}) {
    const auto sizes = allan_cluster_sizes(AllanGrid::kOctave, rate.size());
    const auto curve = allan_deviation(rate, 1, sizes, AllanEstimator::kOverlapping, "x").value();
    EXPECT_FALSE(extract_coefficients(curve, allan_confidence(curve, rate, 0.683), "x"));
  }
}

}  // namespace
}  // namespace prism::evaluation
