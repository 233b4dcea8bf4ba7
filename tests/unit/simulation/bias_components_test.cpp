// SPDX-License-Identifier: MIT
// Each bias component has the configured size.
#include "tools/prismsim/simulation/bias_components.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tools/prismsim/simulation/chamber_profile.hpp"
#include "tools/prismsim/simulation/simulated_gyro.hpp"

namespace prism::simulation {
namespace {

struct HiddenBiasTest : testing::Test {
  BiasModelSettings settings;
};

TEST_F(HiddenBiasTest, IsZeroByDefault) {
  SimulatedGyro gyro(paper_profile(), 3);
  for (int s = 0; s < 30000; ++s) gyro.step(1);
  EXPECT_EQ(gyro.truth().bias_deg_per_h, gyro.truth().causes.thermal);
  EXPECT_EQ(gyro.truth().sensor_degc, gyro.truth().body_degc);
}

// Heated and cooled by 60 degC, the same temperature has two biases, 2 sizes apart; directly after a reversal they
// meet.
TEST_F(HiddenBiasTest, HysteresisSeparatesHeatingAndCooling) {
  settings.hysteresis_deg_per_h = 0.01;
  HiddenBias hidden(settings, 0, 1);
  double heating = 0, halfway = 1, cooling = 0, time_s = 0;
  for (double t = 0; t <= 60; t += 0.1) {
    const double now = hidden.step(++time_s, t).hysteresis;
    if (std::abs(t - 30) < 0.05) heating = now;
  }
  for (double t = 60; t >= 0; t -= 0.1) {
    const double now = hidden.step(++time_s, t).hysteresis;
    if (std::abs(t - 30) < 0.05) cooling = now;
    if (std::abs(t - 45) < 0.05) halfway = now;  // 15 degC after the reversal
  }
  EXPECT_NEAR(halfway, 0, 1e-4);
  EXPECT_NEAR(heating, 0.01, 1e-9);
  EXPECT_NEAR(cooling, -0.01, 1e-9);
}

TEST_F(HiddenBiasTest, WarmUpAgeingAndTiltDependOnTime) {
  settings.warm_up_deg_per_h = 0.02;
  settings.ageing_deg_per_h_per_day = 0.005;
  settings.tilt_deg_per_h = 0.003;
  HiddenBias hidden(settings, 25, 1);
  EXPECT_NEAR(hidden.at_start().warm_up, 0.02, 1e-12);
  EXPECT_NEAR(hidden.step(3600, 25).warm_up, 0.02 / std::numbers::e, 1e-12);
  const BiasComponents noon = hidden.step(43200, 25), midnight = hidden.step(86400, 25);
  EXPECT_NEAR(midnight.ageing, 0.005, 1e-12);
  EXPECT_NEAR(noon.tilt, -midnight.tilt, 1e-12);
}

TEST_F(HiddenBiasTest, TurnOnOffsetsHaveTheirSizeAndAreConstantInARun) {
  settings.turn_on_deg_per_h = 0.004;
  double squares = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    HiddenBias hidden(settings, 25, seed);
    const double offset = hidden.at_start().turn_on;
    EXPECT_EQ(hidden.step(1000, 60).turn_on, offset);
    squares += offset * offset;
  }
  EXPECT_NEAR(std::sqrt(squares / 400), 0.004, 0.0006);  // 4 sigma of 400 draws
}

// Flicker of coefficient B: the Allan deviation is 0.664 B over the range of the processes' time constants.
TEST_F(HiddenBiasTest, FlickerHasAFlatAllanDeviation) {
  settings.flicker_deg_per_h = 0.01;
  for (const int m : {100, 1000}) {
    double squares = 0;
    int pairs = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      HiddenBias hidden(settings, 25, seed);
      double before = 0;
      for (int k = 0; k < 40; ++k) {
        double mean = 0;
        for (int s = 0; s < m; ++s) mean += hidden.step(k * m + s, 25).flicker / m;
        if (k > 0) {
          squares += (mean - before) * (mean - before);
          ++pairs;
        }
        before = mean;
      }
    }
    EXPECT_NEAR(std::sqrt(squares / (2 * pairs)), 0.00664, 0.0007) << m;
  }
}

TEST_F(HiddenBiasTest, ModeHopsFollowTheBodyTemperatureNotTime) {
  settings.mode_hops_deg_per_h = 0.01;
  HiddenBias hidden(settings, 25, 5);
  double last = hidden.at_start().mode_hops;
  for (int s = 1; s < 100000; ++s) ASSERT_EQ(hidden.step(s, 25).mode_hops, last);
  int hops = 0;
  for (int s = 1; s <= 25000; ++s) {  // path of 2500 degC: mean 100 hops, sigma 10
    const double now = hidden.step(100000 + s, 25 + 0.1 * s).mode_hops;
    hops += now != last;
    last = now;
  }
  EXPECT_NEAR(hops, 100, 40);
}

// The thermometer reports a delayed body temperature; the bias follows the body.
TEST_F(HiddenBiasTest, ThermometerLagsButBiasDoesNot) {
  settings.sensor_lag_s = 300;
  SimulatedGyro gyro(paper_profile(), 3, settings), plain(paper_profile(), 3);
  for (int s = 0; s < 36000; ++s) gyro.step(1), plain.step(1);  // one hour into the ramp to 70 degC
  EXPECT_EQ(gyro.truth().bias_deg_per_h, plain.truth().bias_deg_per_h);
  EXPECT_NEAR(gyro.truth().body_degc - gyro.truth().sensor_degc, 300 * gyro.truth().slope_degc_per_s, 0.5);
  EXPECT_GT(gyro.truth().body_degc - gyro.truth().sensor_degc, 1);
}

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
