// SPDX-License-Identifier: MIT
// The drift test by hand; its threshold against the known run length of white noise, and on quiet, shifted and ageing
// gyros.
#include "compensation/evaluation/drift_test.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random_series.hpp"

namespace prism::evaluation {
namespace {

using compensation::MonitorSettings;

constexpr int kDay = 864, kYear = 315576;
constexpr double kPerHour = 36, kLeftSd = 0.007;

/// A first-order autoregressive residual.
class Residual {
 public:
  Residual(double rho, std::uint64_t seed) : rho_(rho), normal_(seed) {}
  double operator()() {
    now_ = rho_ * now_ + std::sqrt(1 - rho_ * rho_) * normal_();
    return kLeftSd * now_;
  }

 private:
  double rho_, now_ = 0;
  test::Normal normal_;
};

Residuals record(Residual residual, int count, double window_s = 100) {
  Residuals all{{}, {}, 1, window_s};
  for (int i = 0; i < count; ++i) all.deg_per_h.push_back(residual());
  all.recordings.assign(all.deg_per_h.size(), 0);
  return all;
}

/// Alarms in quiet years with a switch-on a day.
int alarms(const MonitorSettings& settings, Residual residual, int years) {
  DriftTest test(settings, 0, kPerHour / settings.every);
  int found = 0;
  for (int i = 0; i < years * kYear; ++i) {
    if (i % kDay == 0) test.switch_on();
    const double value = residual();
    if (i % settings.every == 0) found += test.push(value) != 0;
  }
  return found;
}

TEST(DriftTest, TheSumsAreThoseOfPage) {
  DriftTest test({.sd_deg_per_h = 2, .threshold = 4}, 0, kPerHour);
  test.switch_on();
  EXPECT_EQ(test.push(4), 0);
  EXPECT_DOUBLE_EQ(test.up(), 1.5);
  EXPECT_EQ(test.push(-2), 0);
  EXPECT_DOUBLE_EQ(test.up(), 0);
  EXPECT_DOUBLE_EQ(test.down(), 0.5);
  EXPECT_EQ(test.push(6), 0);
  EXPECT_EQ(test.push(6), 2) << "2.5 + 2.5, since two values";
  EXPECT_DOUBLE_EQ(test.up(), 0) << "restarts";
  for (int i = 0; i < 2; ++i) EXPECT_EQ(test.push(-4), 0);
  EXPECT_EQ(test.push(-4), -3);
}

TEST(DriftTest, TheLevelOfTheFirstWeekAndAQuarterOfASdOfASwitchOnAreSubtracted) {
  const MonitorSettings settings{.sd_deg_per_h = kLeftSd, .offset_deg_per_h = 0.5 * kLeftSd, .threshold = 1e9};
  DriftTest small(settings, 0, kPerHour), large(settings, 0, kPerHour), first(settings, 5 * kLeftSd, kPerHour);
  for (DriftTest* test : {&small, &large, &first}) {
    test->switch_on();
    for (int i = 0; i < 100 * kDay; ++i) (void)test->push((test == &small ? 0.4 : 2) * kLeftSd);
  }
  EXPECT_EQ(small.up(), 0);
  EXPECT_NEAR(large.up() / (100 * kDay), 2 - 2 * 0.5 - 0.25 - DriftTest::kAllowance, 0.01);
  first.switch_on();
  const double before = first.up();
  for (int i = 0; i < kDay; ++i) (void)first.push(2 * kLeftSd);
  EXPECT_LT(first.up(), before + 1) << "the direction of the axis belongs to all switch-ons";
}

TEST(DriftTest, ALevelThatIsUnknownBeforeTheFirstWeekIsNoShiftButALaterOneIs) {
  const MonitorSettings settings{.sd_deg_per_h = kLeftSd, .offset_deg_per_h = 0.5 * kLeftSd, .threshold = 500};
  DriftTest test(settings, 0, kPerHour);
  int alarms = 0;
  for (int i = 0; i < 60 * kDay; ++i) {
    if (i % kDay == 0) test.switch_on();
    alarms += test.push(-0.9 * kLeftSd) != 0;
  }
  EXPECT_EQ(alarms, 0);
  while (test.push(0.1 * kLeftSd) == 0) ++alarms;
  EXPECT_NEAR(alarms, 500 / (1 - 0.25 - DriftTest::kAllowance), 200);
}

TEST(DriftTest, RecordingsShowHowMuchSwitchOnsDiffer) {
  Residuals days = record({0, 10}, 20 * kDay);
  for (std::size_t i = 0; i < days.deg_per_h.size(); ++i) {
    days.recordings[i] = static_cast<int>(i) / kDay;
    days.deg_per_h[i] += days.recordings[i] % 2 ? 0.003 : -0.003;
  }
  const auto settings = monitor_settings(days, 0.001, 0);
  ASSERT_TRUE(settings);
  EXPECT_NEAR(settings->offset_deg_per_h, 0.003, 0.0003);
  EXPECT_NEAR(settings->sd_deg_per_h, kLeftSd, 0.02 * kLeftSd) << "without the offsets";
}

// The simulation itself, with windows of an hour, which are few: the numbers are those that it gave when this test was
// written. Every other recording is higher.
TEST(DriftTest, TheSettingsOfAShortRecordAreAsEver) {
  struct Case {
    double rho, offset_sd;
    int recordings, every;
    double sd, offset, threshold, delay_h;
  };
  for (const Case& c : {Case{0, 0, 1, 1, 6.190224077575102e-3, 1.146239837455210e-3, 9.94976467, 54.5},
                        Case{0.5, 0.002, 2, 1, 6.209584980914919e-3, 0.002, 31.5567426, 228},
                        Case{0, 0.001, 5, 1, 6.113582497702302e-3, 1.663423e-3, 7.30886974, 64}}) {
    Residuals residuals = record({c.rho, 12}, 300, 3600);
    for (std::size_t i = 0; i < 300; ++i) {
      residuals.recordings[i] = static_cast<int>(i) * c.recordings / 300;
      residuals.deg_per_h[i] += residuals.recordings[i] % 2 * 0.002;
    }
    const auto settings = monitor_settings(residuals, c.offset_sd, 0);
    ASSERT_TRUE(settings);
    SCOPED_TRACE(c.recordings + c.rho);
    EXPECT_EQ(settings->every, c.every);
    EXPECT_NEAR(settings->sd_deg_per_h, c.sd, 1e-6 * c.sd);
    EXPECT_NEAR(settings->offset_deg_per_h, c.offset, 1e-6 * c.offset);
    EXPECT_NEAR(settings->threshold, c.threshold, 1e-3 * c.threshold);
    EXPECT_NEAR(settings->delay_h, c.delay_h, 1e-3 * c.delay_h);
  }
  EXPECT_EQ(monitor_settings(record({0, 12}, 300, 3600), 0, 1)->sd_deg_per_h, 1) << "at least that";
}

// Siegmund's approximation of the mean run length (1985): (e^b − b − 1) / 2k² with b = 2k (h + 1.166), for one side.
TEST(DriftTest, TheThresholdOfWhiteNoiseHasTheKnownRunLength) {
  const auto settings = monitor_settings(record({0, 1}, 2000 * kDay), 0, 0);
  ASSERT_TRUE(settings);
  EXPECT_NEAR(settings->sd_deg_per_h, kLeftSd, 0.01 * kLeftSd);
  EXPECT_NEAR(settings->threshold, std::log(kYear) - 1.166, 0.6);  // of 5 years: a factor of 1.5 in time is 0.4
  EXPECT_NEAR(settings->delay_h, (settings->threshold + 1) / DriftTest::kAllowance / kPerHour, 0.15);
}

// A short form of tools/bench monitor.
TEST(DriftTest, QuietYearsHaveAboutOneAlarmAndShiftsAreFoundInTime) {
  constexpr int kYears = 20, kShifts = 100;
  for (const double rho : {0.0, 0.6}) {
    const auto known = monitor_settings(record({rho, 2}, 3000 * kDay), 0, 0);
    const auto estimated = monitor_settings(record({rho, 3}, 924), 0, 0);
    ASSERT_TRUE(known && estimated);
    const int found = alarms(*known, {rho, 4}, kYears);
    EXPECT_GE(found, kYears / 4) << "rho " << rho;
    EXPECT_LE(found, 2 * kYears) << "rho " << rho;
    EXPECT_LE(alarms(*estimated, {rho, 5}, kYears), 4 * kYears) << "rho " << rho;
    Residual residual(rho, 6);
    int in_time = 0;
    for (int shift = 0; shift < kShifts; ++shift) {
      DriftTest test(*known, 0, kPerHour);
      test.switch_on();
      for (int i = 0; i < kDay; ++i) (void)test.push(residual());
      int windows = 1;
      while (test.push(residual() + kLeftSd) == 0) ++windows;
      in_time += windows <= 2 * known->delay_h * kPerHour;
    }
    EXPECT_GE(in_time, 92) << "rho " << rho;  // 95 expected, 2.2 is one sigma of 100 runs
  }
}

TEST(DriftTest, AgeingIsNotTakenForTheOffsetsOfSwitchOns) {
  const auto settings = monitor_settings(record({0.3, 7}, 100 * kDay), 0.3 * kLeftSd, 0);
  ASSERT_TRUE(settings);
  DriftTest test(*settings, 0, kPerHour);
  Residual residual(0.3, 8);
  double aged = 0;
  for (int i = 0; i < kYear; ++i) {
    if (i % kDay == 0) test.switch_on();
    aged = 0.01 * i / (kYear / 12.0);
    if (test.push(residual() + aged) != 0) break;
  }
  EXPECT_LT(aged, 2 * kLeftSd);
}

TEST(DriftTest, ASlowResidualIsDecimated) {
  const auto settings = monitor_settings(record({0.97, 9}, 100 * kDay), 0, 0);
  ASSERT_TRUE(settings);
  EXPECT_NEAR(settings->every, 8, 1);  // 0.97^8 = 0.78
  EXPECT_LE(settings->correlation, 0.81);
  EXPECT_FALSE(monitor_settings(record({0, 1}, 99), 0, 0)) << "too few";
}

}  // namespace
}  // namespace prism::evaluation
