// SPDX-License-Identifier: MIT
// Chamber profiles: the paper's to the minute, the others within its range.
#include "tools/prismsim/simulation/chamber_profile.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace prism::simulation {
namespace {

constexpr double kRounding = 1e-9;  // degC

TEST(ChamberProfile, PaperCycleHas924BlocksOfHundredSeconds) { EXPECT_EQ(paper_profile().duration_s(), 92400); }

// 2 h at 25; 65 min down to −40; 6 h; 110 min up to 70; 10 h; 45 min down to 25; 4 h.
TEST(ChamberProfile, PaperCycleFollowsItsTimetable) {
  const ChamberProfile paper = paper_profile();
  const auto at = [&](double hours, double minutes) { return paper.temperature_degc(hours * 3600 + minutes * 60); };
  EXPECT_NEAR(at(0, 0), 25, kRounding);
  EXPECT_NEAR(at(2, 0), 25, kRounding);
  EXPECT_NEAR(at(2, 1), 24, kRounding);
  EXPECT_NEAR(at(2, 65), -40, kRounding);
  EXPECT_NEAR(at(8, 65), -40, kRounding);
  EXPECT_NEAR(at(8, 66), -39, kRounding);
  EXPECT_NEAR(at(8, 175), 70, kRounding);
  EXPECT_NEAR(at(18, 175), 70, kRounding);
  EXPECT_NEAR(at(18, 177), 68, kRounding);
  EXPECT_NEAR(at(18, 220), 25, kRounding);
  EXPECT_NEAR(at(22, 219), 25, kRounding);
}

TEST(ChamberProfile, CyclesRepeatWithoutAStep) {
  for (const ChamberProfile& profile : {paper_profile(), second_profile(), third_profile(), beyond_profile(),
                                        fast_profile(), steady_profile(), warm_up_profile()}) {
    const double cycle_s = profile.duration_s();
    EXPECT_EQ(profile.segments.back().end_degc, profile.start_degc) << profile.name;
    for (double t = 0; t < cycle_s; t += 613) {
      EXPECT_NEAR(profile.temperature_degc(t), profile.temperature_degc(cycle_s + t), kRounding) << profile.name << t;
    }
  }
}

TEST(ChamberProfile, SecondCycleIsWithinTheRangeOfTheFirst) {
  const ChamberProfile paper = paper_profile(), second = second_profile();
  EXPECT_NEAR(second.duration_s(), paper.duration_s(), kRounding);
  double lowest = 100, highest = -100, apart = 0;
  for (double t = 0; t < second.duration_s(); t += 10) {
    lowest = std::min(lowest, second.temperature_degc(t));
    highest = std::max(highest, second.temperature_degc(t));
    apart += std::abs(second.temperature_degc(t) - paper.temperature_degc(t)) * 10 / second.duration_s();
  }
  EXPECT_GE(lowest, -40);
  EXPECT_LE(highest, 70);
  EXPECT_GT(apart, 20);
}

TEST(ChamberProfile, ReportsAnUnknownNameWithTheKnownOnes) {
  for (const char* name : {"paper", "second", "third", "beyond", "fast", "steady", "warm-up"})
    EXPECT_EQ(find_profile(name)->name, name);
  const auto unknown = find_profile("fourth");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().text(),
            "found profile \"fourth\", expected one of paper, second, third, beyond, fast, steady, warm-up");
}

}  // namespace
}  // namespace prism::simulation
