// SPDX-License-Identifier: MIT
// find_response: the time constant of a body whose temperature makes the bias.
#include "compensation/training/response.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <random>

namespace prism::training {
namespace {

constexpr double kBlock_s = 100;

/// Cycles of 6 h of a thermometer; the bias follows a body that is `tau_s` behind it.
TrainingData record(int blocks, double tau_s) {
  TrainingData data{{"T", "dTdt"}, Eigen::MatrixXd(2, blocks), Eigen::VectorXd(blocks), {}, Eigen::VectorXd(blocks)};
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, 0.002);
  double air = 0, body = 0;
  for (int k = 0; k < blocks; ++k) {
    const double before = air;
    air = 30 * std::sin(2 * M_PI * k * kBlock_s / 21'600);
    for (int s = 0; s < 100; ++s) body += tau_s > 0 ? (before + (air - before) * s / 100 - body) / tau_s : 0;
    const double follows = tau_s > 0 ? body : air;
    data.inputs.col(k) << (air + before) / 2, (air - before) / kBlock_s;
    data.target[k] = 0.001 * follows + 0.00002 * follows * follows + noise(random);
    data.time_s[k] = kBlock_s * (k + 1);
    data.runs.push_back(0);
  }
  return data;
}

TEST(Response, IsThatOfTheBodyThatMakesTheBias) {
  const auto found = find_response(record(900, 1800), {}, kBlock_s);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->tau_s, 1800, 200);
  EXPECT_LT(found->low_s, found->tau_s);
  EXPECT_GT(found->high_s, found->tau_s);
  EXPECT_GT(found->gain, 10);
}

TEST(Response, IsNoneOfAThermometerInTheBody) {
  const auto found = find_response(record(900, 0), {}, kBlock_s);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->tau_s, 0);
}

TEST(Response, IsUnknownOfARecordThatCannotTell) {
  EXPECT_FALSE(find_response(record(280, 1800), {}, kBlock_s));  // shorter than 8 h
  TrainingData passage = record(900, 1800);
  passage.inputs.row(0) = Eigen::RowVectorXd::LinSpaced(900, -30, 30);
  EXPECT_FALSE(find_response(passage, {}, kBlock_s));
  TrainingData other = record(900, 1800);
  other.names[1] = "case-T";
  EXPECT_FALSE(find_response(other, {}, kBlock_s));
  for (const auto& names :
       {std::vector<std::string>{"U", "dTdt"}, {"T", "U"}}) {  // without dTdt it would stand for the slope
    other.names = names;
    EXPECT_FALSE(find_response(other, {}, kBlock_s));
  }
  TrainingData constant = record(900, 1800);
  constant.names.emplace_back("U");
  constant.inputs.conservativeResize(3, Eigen::NoChange);
  constant.inputs.row(2).setConstant(5);
  EXPECT_FALSE(find_response(constant, {}, kBlock_s));
  const std::atomic<bool> stop = true;
  TrainingSettings stopped;
  stopped.stop = &stop;
  EXPECT_FALSE(find_response(record(900, 1800), stopped, kBlock_s));
}

}  // namespace
}  // namespace prism::training
