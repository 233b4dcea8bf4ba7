// SPDX-License-Identifier: MIT
// The Earth rate on an axis, for directions with an obvious result.
#include "compensation/earth_rate.hpp"

#include <gtest/gtest.h>

namespace prism::compensation {
namespace {

constexpr double kExact = 1e-12;

TEST(EarthRate, IsCompleteAlongTheAxisOfTheEarth) {
  EXPECT_NEAR(earth_rate_deg_per_h({90, 90, 0}), 15.041067, kExact);    // up at the north pole
  EXPECT_NEAR(earth_rate_deg_per_h({0, 0, 0}), 15.041067, kExact);      // north at the equator
  EXPECT_NEAR(earth_rate_deg_per_h({50, 50, 0}), 15.041067, kExact);    // at the pole star
  EXPECT_NEAR(earth_rate_deg_per_h({-90, 90, 0}), -15.041067, kExact);  // up at the south pole
  EXPECT_NEAR(earth_rate_deg_per_h({0, 0, 180}), -15.041067, kExact);   // south at the equator
}

TEST(EarthRate, IsZeroAcrossTheAxisOfTheEarth) {
  EXPECT_NEAR(earth_rate_deg_per_h({0, 90, 0}), 0, kExact);      // up at the equator
  EXPECT_NEAR(earth_rate_deg_per_h({34.25, 0, 90}), 0, kExact);  // east anywhere
  EXPECT_NEAR(earth_rate_deg_per_h({40, 50, 180}), 0, kExact);   // southward, at the celestial equator
}

// 15.041067 sin 34.25° = 15.041067 · 0.562805 = 8.46519; its horizontal part 15.041067 · 0.826590 = 12.43279.
TEST(EarthRate, OfTheDefaultSiteIsThatOfXian) {
  EXPECT_NEAR(earth_rate_deg_per_h({}), 8.46519, 1e-5);
  EXPECT_NEAR(earth_rate_deg_per_h({34.25, 0, 0}), 12.43279, 1e-5);
  EXPECT_NEAR(earth_rate_deg_per_h({34.25, 0, 60}), 12.43279 / 2, 1e-5);
}

}  // namespace
}  // namespace prism::compensation
