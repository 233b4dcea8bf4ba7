// SPDX-License-Identifier: MIT
// The search finds profiles within the limits of the chamber, the same ones every time.
#include "tools/prismcal/design/profile_search.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tools/prismcal/design/plan.hpp"
#include "tools/prismcal/design/stated_prior.hpp"

namespace prism::design {
namespace {

constexpr ChamberLimits kLimits{-40, 70, 2, 25};

void expect_possible(const simulation::ChamberProfile& profile, double hours) {
  EXPECT_NEAR(profile.duration_s(), hours * 3600, 60);
  EXPECT_LE(profile.segments.size(), 8U);
  double from = profile.start_degc;
  for (const auto& segment : profile.segments) {
    EXPECT_GE(segment.end_degc, kLimits.low_degc);
    EXPECT_LE(segment.end_degc, kLimits.high_degc);
    EXPECT_LE(std::abs(segment.end_degc - from) / (segment.duration_s / 60), kLimits.rate_degc_per_min + 1e-9);
    from = segment.end_degc;
  }
}

// Mean distance of the chamber from 55 degC: the best profile goes there at once and stays.
TEST(ProfileSearch, FindsAKnownProfile) {
  const auto cost = [](const simulation::ChamberProfile& profile) {
    double sum = 0;
    for (double t = 0; t < profile.duration_s(); t += 60) sum += std::abs(profile.temperature_degc(t) - 55);
    return sum / (profile.duration_s() / 60);
  };
  const FoundProfile found = find_profile(kLimits, 4, cost, 3000);
  expect_possible(found.profile, 4);
  const double best = cost({"", 25, {{15 * 60, 55}, {225 * 60, 55}}});
  EXPECT_LT(found.cost, best + 0.3);
  EXPECT_EQ(found.cost, cost(found.profile));
  EXPECT_EQ(set_points_csv(find_profile(kLimits, 4, cost, 3000).profile), set_points_csv(found.profile));
}

TEST(ProfileSearch, FindsNothingInTooShortATime) {
  const auto cost = [](const simulation::ChamberProfile&) { return 1.0; };
  EXPECT_TRUE(find_profile({-40, 70, 0.1, 25}, 0.5, cost, 3000).profile.segments.empty());
}

TEST(Plan, IsBetterThanSimpleProfilesOfTheSameLength) {
  PlanSettings settings;
  settings.chamber = kLimits;
  settings.domain = {{"T", -30, 70}, {"dTdt", -0.008, 0.008}};
  const auto plan = plan_recording({stated_gyro(settings.domain, 0.02, 0.0064)}, settings);
  ASSERT_TRUE(plan) << plan.error().text();
  expect_possible(plan->profile, 8);
  EXPECT_EQ(plan->before_deg_per_h, 0.02);
  EXPECT_LT(plan->after_deg_per_h, 0.012);
  ASSERT_EQ(plan->others.size(), 4U);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_LT(plan->after_deg_per_h, plan->others[i].sd_deg_per_h) << i;
  // The same profile once more is worth less than the first time.
  settings.made = {plan->expected};
  const auto next = plan_recording({stated_gyro(settings.domain, 0.02, 0.0064)}, settings);
  ASSERT_TRUE(next);
  ASSERT_EQ(next->made.size(), 1U);
  EXPECT_NEAR(next->before_deg_per_h, plan->after_deg_per_h, 1e-12);
  EXPECT_LE(next->after_deg_per_h, next->repeated_deg_per_h);
  EXPECT_LT(next->repeated_deg_per_h, next->before_deg_per_h);
}

}  // namespace
}  // namespace prism::design
