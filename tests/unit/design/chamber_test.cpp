// SPDX-License-Identifier: MIT
// Limits of the chamber and domains as text; the profiles to compare.
#include "tools/prismcal/design/chamber.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace prism::design {
namespace {

TEST(ChamberLimits, AreReadFromText) {
  const auto limits = parse_chamber("rate<=2 degC/min, T=-45:65", 25);
  ASSERT_TRUE(limits) << limits.error().text();
  EXPECT_EQ(limits->rate_degc_per_min, 2);
  EXPECT_EQ(limits->low_degc, -45);
  EXPECT_EQ(limits->high_degc, 65);
  EXPECT_EQ(parse_chamber("rate<=0.05 degC/s", 25)->rate_degc_per_min, 3);
  EXPECT_EQ(parse_chamber("", 25)->high_degc, 70);
}

TEST(ChamberLimits, NameWhatIsWrong) {
  const auto error = [](const char* text) { return parse_chamber(text, 25).error().text(); };
  EXPECT_EQ(error("T=65:-45"), "--chamber: T: found 65:-45, expected the lower limit first");
  EXPECT_EQ(error("speed<=2"), "--chamber: found \"speed\", expected \"rate<=2 degC/min\" or \"T=-45:65\"");
  EXPECT_EQ(error("rate<=2 K/min"), "--chamber: found unit \"K/min\", expected degC/min or degC/s");
  EXPECT_EQ(error("rate<=0"), "--chamber: found a rate of 0 degC/min, expected a positive one");
  EXPECT_EQ(error("rate=2"), "--chamber: found \"rate=2\", expected \"rate<=2 degC/min\" or \"T=-45:65\"");
  EXPECT_EQ(error("T=-500:60000"), "--chamber: T: found -500:60000, expected limits within -200 to 300 degC");
  EXPECT_EQ(error("T=30:40"), "--start: found 25 degC, expected 30 to 40, the limits of the chamber");
}

TEST(Domain, ConvertsSlopesToTheUnitOfTheInputs) {
  const auto domain = parse_domain("T=-40:60, dTdt=-1.2:0.6 degC/min");
  ASSERT_TRUE(domain) << domain.error().text();
  ASSERT_EQ(domain->size(), 2U);
  EXPECT_EQ((*domain)[0].input, "T");
  EXPECT_EQ((*domain)[0].low, -40);
  EXPECT_DOUBLE_EQ((*domain)[1].low, -0.02);
  EXPECT_DOUBLE_EQ((*domain)[1].high, 0.01);
}

TEST(Domain, NamesWhatIsWrong) {
  const auto error = [](const char* text) { return parse_domain(text).error().text(); };
  EXPECT_EQ(error("dTdt=-1:1"), "--domain: dTdt: found unit \"\", expected degC/min or degC/s");
  EXPECT_EQ(error("T=-40:60, T=0:1"), "--domain: found T twice, expected it once");
  EXPECT_EQ(error("T<=60"), "--domain: T: found <=, expected T=LOW:HIGH");
  EXPECT_EQ(error(""), "--domain: found \"\", expected NAME=LOW:HIGH, for example \"T=-40:60, dTdt=-1:1 degC/min\"");
  EXPECT_EQ(error("T=nan:60").substr(0, 28), "--domain: found \"T=nan:60\", ");
}

TEST(ChamberProfiles, StayWithinTheLimits) {
  const ChamberLimits limits{-30, 60, 2, 20};
  std::vector<simulation::ChamberProfile> all = simple_profiles(limits, 8);
  for (const auto& profile : all) EXPECT_NEAR(profile.duration_s(), 8 * 3600, 60) << profile.name;
  all.push_back(paper_within(limits));
  for (const auto& profile : all) {
    double from = profile.start_degc;
    for (const auto& segment : profile.segments) {
      EXPECT_GE(segment.end_degc, -30) << profile.name;
      EXPECT_LE(segment.end_degc, 60) << profile.name;
      EXPECT_LE(std::abs(segment.end_degc - from) / (segment.duration_s / 60), 2 + 1e-9) << profile.name;
      from = segment.end_degc;
    }
  }
}

TEST(ChamberProfiles, AreWrittenAsSetPoints) {
  EXPECT_EQ(set_points_csv({"x", 25, {{600, -5}, {1800, -5}}}),
            "time_s,temperature_degc\n0,25.0\n600,-5.0\n2400,-5.0\n");
}

}  // namespace
}  // namespace prism::design
