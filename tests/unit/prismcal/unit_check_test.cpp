// SPDX-License-Identifier: MIT
// A rate in a wrong unit shows in its mean, because the Earth rate is known; a large bias does not.
#include "tools/prismcal/recordings/unit_check.hpp"

#include <gtest/gtest.h>

namespace prism::recordings {
namespace {

TEST(UnitCheck, NamesTheUnitInWhichTheMeanIsTheEarthRate) {
  constexpr double kEarth = 8.4652, kRadPerS = 206264.80625;
  EXPECT_EQ(likely_unit(kEarth / kRadPerS, kEarth), "rad/s");
  EXPECT_EQ(likely_unit(1.2 * kEarth / 3600, kEarth), "deg/s");
  EXPECT_EQ(likely_unit(-kEarth / 3600, -kEarth), "deg/s");
  EXPECT_EQ(likely_unit(0.9 * kEarth * 3600, kEarth), "deg/h");
  EXPECT_EQ(likely_unit(-kEarth * kRadPerS, -kEarth), "deg/h");
  for (const double plausible : {kEarth, 0.8 * kEarth, 1.25 * kEarth, 120.0, -300.0, 0.0, 20'000.0})
    EXPECT_FALSE(likely_unit(plausible, kEarth)) << plausible;
  EXPECT_FALSE(likely_unit(0.1 / kRadPerS, 0.1)) << "the bias may be larger than this Earth rate";
}

}  // namespace
}  // namespace prism::recordings
