// SPDX-License-Identifier: MIT
// Evenly spread normal numbers.
#include "compensation/evaluation/even_draws.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/power_law_noise.hpp"

namespace prism::evaluation {
namespace {

// Any sum of the four, scaled to an sd of 1, is within 1 in 68.3 % of the draws. Before, two of the four numbers had a
// correlation of -0.18, and the share was 59 to 75 %: Allan intervals of Q held the truth in 65 % of the records.
TEST(EvenDraws, EverySumOfTheFourIsNormal) {
  test::NormalPairs normal(1);
  const auto& draws = even_normal_draws();
  const double n = static_cast<double>(draws.size());
  for (int direction = 0; direction < 500; ++direction) {
    Eigen::Vector4d weights;
    for (double& weight : weights) weight = normal();
    weights.normalize();
    const auto share = [&](double low, double high) {
      const auto inside = [&](const Eigen::Vector4d& z) { return low < weights.dot(z) && weights.dot(z) < high; };
      return static_cast<double>(std::count_if(draws.begin(), draws.end(), inside)) / n;
    };
    EXPECT_NEAR(share(-1, 1), 0.6827, 0.035) << weights.transpose();
    EXPECT_NEAR(share(-10, 0.476), 0.683, 0.02) << weights.transpose();
  }
}

}  // namespace
}  // namespace prism::evaluation
