// SPDX-License-Identifier: MIT
// The weight functions at their corners, and when the re-weighting ends.
#include "compensation/training/robust.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace prism::training {
namespace {

TEST(WeightFunction, IsThatOfThePaper) {
  const auto at = [](WeightKind kind, double u, double parameter = 1, double floor = 0.25) {
    return WeightFunction{kind, parameter, floor}(u);
  };
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(at(WeightKind::kNone, sign * 9), 1);
    EXPECT_EQ(at(WeightKind::kHuber, sign * 1.9, 2), 1);
    EXPECT_EQ(at(WeightKind::kHuber, sign * 4, 2), 0.5);
    EXPECT_EQ(at(WeightKind::kHampel, sign * 2.5), 1);
    EXPECT_EQ(at(WeightKind::kHampel, sign * 2.75), 0.5);
    EXPECT_EQ(at(WeightKind::kHampel, sign * 2.9), 0.25) << "the floor above 0.2";
    EXPECT_EQ(at(WeightKind::kHampel, sign * 3.1), 0.25);
    EXPECT_NEAR(at(WeightKind::kHampel, sign * 3, 1, 0), 0, 1e-15);
    EXPECT_EQ(at(WeightKind::kLogistic, sign * 2), std::tanh(2) / 2);
    EXPECT_EQ(at(WeightKind::kMyriad, sign * 3, 2), 4.0 / 13);
  }
  EXPECT_EQ(at(WeightKind::kLogistic, 0), 1);
  EXPECT_EQ(usual_parameter(WeightKind::kHuber), 1.345);
  EXPECT_EQ(usual_parameter(WeightKind::kMyriad), 1);
  for (const char* name : {"none", "huber", "hampel", "logistic", "myriad"})
    EXPECT_STREQ(weight_name(weight_by_name(name)), name);
  EXPECT_EQ(weight_by_name("tukey"), WeightKind::kNone);
  std::string with_parameter;
  for (const char* name : {"none", "huber", "hampel", "logistic", "myriad"})
    with_parameter += WeightFunction{weight_by_name(name)}.has_parameter() ? "1" : "0";
  EXPECT_EQ(with_parameter, "01001");
}

/// Solves of a given sequence of residuals, the last one again and again.
struct Solves {
  std::vector<Eigen::VectorXd> residuals;
  std::size_t next = 0;
  std::vector<Eigen::VectorXd> weights = {};

  Result<ReweightReport> run(const ReweightSettings& settings, const StepRule& rule) {
    Eigen::VectorXd weight = Eigen::VectorXd::Ones(residuals[0].size());
    next = 0, weights.clear();
    auto report = reweight(
        settings, weight,
        [this](const Eigen::VectorXd& v) -> Result<Eigen::VectorXd> {
          weights.push_back(v);
          return residuals[std::min(next++, residuals.size() - 1)];
        },
        rule);
    EXPECT_EQ(weight, weights.back());
    return report;
  }
};

// The distances from the median 0 are 2, 0, 1, 0 and 10.86, their median is 1: a scale of 1.483.
Eigen::VectorXd some() {
  Eigen::VectorXd r(5);
  r << -2, 0, -1, 0, 10.86;
  return r;
}

TEST(Reweight, AWeightIsThatOfTheResidualInScales) {
  Solves solves{{some()}};
  ReweightSettings settings;
  settings.weight = {WeightKind::kHampel, 1, 0};
  const auto report = solves.run(settings, residuals_within(1e-9));
  ASSERT_TRUE(report);
  EXPECT_DOUBLE_EQ(report->scale, 1.483);
  EXPECT_EQ(solves.weights.size(), 2u);
  EXPECT_EQ(solves.weights[1], (Eigen::VectorXd(5) << 1, 1, 1, 1, 0).finished());
  EXPECT_EQ(report->solves, 1);
  EXPECT_TRUE(report->converged);
  EXPECT_EQ(report->dropped, 1);
  settings.min_weight = 0.125;
  EXPECT_EQ(solves.run(settings, residuals_within(1e-9))->dropped, 0);
  EXPECT_EQ(solves.weights[1][4], 0.125);
  settings.weight.kind = WeightKind::kNone;
  EXPECT_EQ(solves.run(settings, residuals_within(1e-9))->solves, 0);
  EXPECT_TRUE(solves.run(settings, residuals_within(1e-9))->converged);
}

// A change of 0.1483 is a tenth of the scale.
TEST(Reweight, ResidualsConvergeWithinScales) {
  Eigen::VectorXd moved = some();
  moved[0] -= 0.1483;
  for (const double tolerance : {0.09, 0.11}) {
    Solves solves{{some(), moved}};
    ReweightSettings settings{.weight = {WeightKind::kMyriad}};
    EXPECT_EQ(solves.run(settings, residuals_within(tolerance))->solves, tolerance < 0.1 ? 2 : 1);
    settings.limit = 1;
    EXPECT_EQ(solves.run(settings, residuals_within(tolerance))->converged, tolerance > 0.1);
  }
}

TEST(Reweight, WithEqualResidualsAllWeightsAreOne) {
  Solves solves{{Eigen::VectorXd::Constant(4, 2.0)}};
  const auto report = solves.run({.weight = {WeightKind::kHampel, 1, 0}}, weights_settled());
  EXPECT_EQ(report->scale, 0);
  EXPECT_EQ(report->dropped, 0);
  EXPECT_EQ(report->solves, 1);
}

// Weights that alternate between two states: from the 21st on they are averages, which move by half.
TEST(Reweight, WeightsThatAlternateAreAveragedAfterTwentySolves) {
  Solves solves;
  for (int i = 0; i < 60; ++i) {
    Eigen::VectorXd r = some();
    r[4] *= i % 2 ? 0 : 1;
    solves.residuals.push_back(r);
  }
  ReweightSettings settings;
  settings.weight = {WeightKind::kHampel, 1, 0};
  settings.limit = 40;
  const auto report = solves.run(settings, weights_settled());
  EXPECT_EQ(report->solves, 40);
  EXPECT_TRUE(report->oscillating);
  EXPECT_FALSE(report->converged);
  EXPECT_EQ(solves.weights[19][4], 0);
  EXPECT_EQ(solves.weights[20][4], 1) << "the 20th re-weighting";
  EXPECT_EQ(solves.weights[21][4], 0.5);
  EXPECT_EQ(solves.weights[22][4], 0.75);
  settings.limit = 19;
  EXPECT_FALSE(solves.run(settings, weights_settled())->oscillating);
  settings.limit = 20;
  EXPECT_TRUE(solves.run(settings, weights_settled())->oscillating);
}

// Myriad's weight of u changes from 1 / (1 + u²) by less than a thousandth, or by more.
TEST(Reweight, WeightsAreSettledBelowAThousandth) {
  for (const double step : {0.0009, 0.0011}) {
    Eigen::VectorXd first = some(), second = some();
    const double at = first[0] / 1.483, weight = 1 / (1 + at * at);
    second[0] = -1.483 * std::sqrt(1 / (weight + step) - 1);
    Solves solves{{first, second}};
    // Of the second solve: weights of the first residuals, then of the second ones, which are then equal.
    EXPECT_EQ(solves.run({.weight = {WeightKind::kMyriad}}, weights_settled())->solves, step < 0.001 ? 2 : 3);
  }
}

}  // namespace
}  // namespace prism::training
