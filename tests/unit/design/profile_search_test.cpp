// SPDX-License-Identifier: MIT
// Profiles of the chamber: its limits, the inputs of a profile, the search for the best.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tests/support/blocks.hpp"
#include "tests/unit/design/stated_gyro.hpp"
#include "tools/prismcal/plan.hpp"
#include "tools/prismcal/profiles.hpp"
#include "tools/prismsim/simulation/simulated_gyro.hpp"

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

// The longest is the best: a ramp at half the speed takes 2 min.
TEST(ProfileSearch, EndsInItsTime) {
  const auto cost = [](const simulation::ChamberProfile& profile) { return -profile.duration_s(); };
  EXPECT_EQ(find_profile({25, 27, 2, 25}, 1.0 / 60, cost, 3000).profile.duration_s(), 60);
}

TEST(Plan, IsBetterThanSimpleProfilesOfTheSameLength) {
  PlanSettings settings;
  settings.chamber = kLimits;
  settings.domain = {{"T", -30, 70}, {"dTdt", -0.008, 0.008}};
  const auto plan = plan_recording({stated_gyro(settings.domain, 0.02, 0.0064)}, settings);
  ASSERT_TRUE(plan) << plan.error().text();
  expect_possible(plan->profile, 8);
  EXPECT_EQ(plan->before_deg_per_h(), 0.02);
  EXPECT_LT(plan->after_deg_per_h, 0.012);
  ASSERT_EQ(plan->others.size(), 4U);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_LT(plan->after_deg_per_h, plan->others[i].sd_deg_per_h) << i;
  // The same profile once more is worth less than the first time.
  KnownGyro recorded = stated_gyro(settings.domain, 0.02, 0.0064);
  recorded.recordings = {plan->expected};
  const auto next = plan_recording({recorded}, settings);
  ASSERT_TRUE(next);
  ASSERT_EQ(next->made.size(), 2U);
  EXPECT_NEAR(next->before_deg_per_h(), plan->after_deg_per_h, 0.01 * plan->after_deg_per_h);  // other pivots
  ASSERT_EQ(next->others.back().name, "like the last");
  EXPECT_LE(next->after_deg_per_h, next->others.back().sd_deg_per_h);
  EXPECT_LT(next->others.back().sd_deg_per_h, next->before_deg_per_h());
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
  for (const test::Block& row : test::blocks("design/option_errors.txt", 2))
    EXPECT_EQ(parse_domain(row.text(0)).error().text(), row[1]) << row.where;
  EXPECT_EQ(parse_domain("T=nan:60").error().text().substr(0, 28), "--domain: found \"T=nan:60\", ");
}

TEST(ChamberProfiles, StayWithinTheLimits) {
  const ChamberLimits limits{-30, 60, 2, 20};
  const std::vector<simulation::ChamberProfile> all = usual_profiles(limits, 8);
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_NEAR(all[i].duration_s(), 8 * 3600, 60) << all[i].name;
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

const simulation::ChamberProfile kProfile{"test", 25, {{3600, -40}, {7200, -40}, {3600, 60}, {3600, 60}}};

TEST(GyroInputs, FollowTheSimulatedGyro) {
  const auto inputs = GyroInputs::make({"T", "dTdt"}, {}, {}, {});
  ASSERT_TRUE(inputs) << inputs.error().text();
  const RecordedInputs recorded = inputs->on(kProfile);
  ASSERT_EQ(recorded.inputs.cols(), 180);
  simulation::SimulatedGyro gyro(kProfile, 1);
  double mean = 0, before = gyro.truth().body_degc;
  for (Eigen::Index i = 0; i < recorded.inputs.cols(); ++i) {
    mean = 0;
    for (int s = 0; s < 100; ++s) mean += gyro.step(1).body_degc / 100;
    const double body = gyro.truth().body_degc;
    EXPECT_NEAR(recorded.inputs(0, i), mean, 0.1) << i;  // the mean of both ends, in steps of 10 s
    EXPECT_NEAR(recorded.inputs(1, i), (body - before) / 100, 2e-4) << i;
    EXPECT_NEAR(recorded.time_h[i], static_cast<double>(i + 1) / 36, 1e-9);
    before = body;
  }
}

TEST(GyroInputs, WithoutLagTheGyroIsAtTheChamber) {
  const auto inputs = GyroInputs::make({"T"}, {}, {0, 0}, {});
  const RecordedInputs recorded = inputs->on({"soak", 25, {{1000, 25}}}, 2);
  ASSERT_EQ(recorded.inputs.cols(), 5);
  EXPECT_EQ(recorded.inputs(0, 4), 25);
}

TEST(GyroInputs, OtherInputsFollowTheTemperatureAsRecorded) {
  RecordedInputs recorded;
  recorded.inputs.resize(2, 100);
  recorded.time_h = Eigen::VectorXd::LinSpaced(100, 0, 3);
  recorded.inputs.row(0) = Eigen::RowVectorXd::LinSpaced(100, -20, 50);
  recorded.inputs.row(1) = 5.4 - 0.003 * recorded.inputs.row(0).array();
  const auto inputs = GyroInputs::make({"T", "U"}, {}, {}, {recorded});
  ASSERT_TRUE(inputs) << inputs.error().text();
  const Eigen::MatrixXd x = inputs->on(kProfile).inputs;
  for (Eigen::Index i = 0; i < x.cols(); ++i) EXPECT_NEAR(x(1, i), 5.4 - 0.003 * x(0, i), 0.01) << i;
  const auto points = inputs->over({{"T", -10, 40}}, 50);
  ASSERT_TRUE(points);
  EXPECT_GE(points->row(0).minCoeff(), -10);
  EXPECT_LE(points->row(0).maxCoeff(), 40);
  EXPECT_GT(points->row(0).maxCoeff() - points->row(0).minCoeff(), 45);
}

TEST(GyroInputs, NameWhatIsMissing) {
  EXPECT_EQ(GyroInputs::make({"dTdt"}, {}, {}, {}).error().text(), "inputs: found dTdt, expected T among them");
  EXPECT_EQ(
      GyroInputs::make({"T", "U"}, {}, {}, {}).error().text(),
      "inputs: U does not follow from the chamber's temperature: design needs a model with its recordings, or --prior");
  const auto inputs = GyroInputs::make({"T"}, {}, {}, {});
  EXPECT_EQ(inputs->over({{"dTdt", 0, 1}}, 5).error().text(), "--domain: found dTdt, expected inputs of the model: T");
  EXPECT_EQ(inputs->over({}, 5).error().text(), "--domain: found no range of T, expected one");
}

}  // namespace
}  // namespace prism::design
