// SPDX-License-Identifier: MIT
#include "drivers/nearest.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace prism::drivers {
namespace {

TEST(Nearest, RoundsHalvesAwayFromZeroAsLlroundDoes) {
  for (const double x : {0.0, 0.5, -0.5, 1.5, -1.5, 2.5, -2.5, 0.49, -0.49, 1e15 + 0.5, -1e15 - 0.5}) {
    EXPECT_EQ(nearest(x), std::llround(x)) << x;
  }
}

TEST(Nearest, IsLlroundOnTheWayOfTimesAndTicks) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(-3, 15);
  for (int i = 0; i < 100000; ++i) {
    const double x = std::pow(10, exponent(random)) * (i % 2 == 0 ? 1 : -1);
    ASSERT_EQ(nearest(x), std::llround(x)) << x;
  }
}

}  // namespace
}  // namespace prism::drivers
