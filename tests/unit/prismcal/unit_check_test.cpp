// SPDX-License-Identifier: MIT
// A rate in a wrong unit shows in its mean, because the Earth rate is known; a large bias does not.
#include "tools/prismcal/recordings/unit_check.hpp"

#include <gtest/gtest.h>

#include "tests/unit/prismcal/simulated_day.hpp"

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

TEST(SignQuestion, IsAskedIfTheMeanIsTheEarthRateWithTheOtherSign) {
  auto day = test::simulated_day(2000, 0.07, 1);
  const auto question = [&] { return sign_question(make_block_table(day, {}, test::kDayEarthRate, "day").value()); };
  EXPECT_EQ(question(), "");
  for (auto& second : day) second.rate_deg_per_h = -second.rate_deg_per_h;
  EXPECT_EQ(
      question(),
      "the mean rate is -8.48 deg/h, the site's Earth rate 8.47 deg/h: has the rate or the elevation the wrong sign?");
  for (auto& second : day) second.rate_deg_per_h -= 3;  // so large a bias explains any mean
  EXPECT_EQ(question(), "");
}

}  // namespace
}  // namespace prism::recordings
