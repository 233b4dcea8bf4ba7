// SPDX-License-Identifier: MIT
// The limits of plausible values; sensor_checks.txt and engine.txt have the checks of a sensor and what is published.
#include "compensation/plausibility.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "compensation/compensated_text.hpp"
#include "compensation/second_averager.hpp"

namespace prism::compensation {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

Sample thermal_sample(double seconds, double temperature_degc) {
  Sample sample;
  sample.time_ns = std::llround(seconds * 1e9);
  sample.rate_deg_per_h = 8;
  sample.interval_s = 0.1;
  sample.temperature_degc = temperature_degc;
  sample.uhfo_v = 5;
  return sample;
}

TEST(Plausibility, TheDefaultsRejectImpossibleValues) {
  Plausibility sensors{PlausibilityLimits()};
  EXPECT_FALSE(sensors.implausible(thermal_sample(0, 25)).any());
  EXPECT_EQ(sensors.implausible(thermal_sample(0.1, -273)), (QuantitySet{false, true, false}));
  Sample sample = thermal_sample(0.2, 25);
  sample.rate_deg_per_h = 3.4e38;
  EXPECT_EQ(sensors.implausible(sample), (QuantitySet{true, false, false}));
  sample.rate_deg_per_h = -3.7e7;
  sample.uhfo_v = 1e30;
  EXPECT_EQ(sensors.implausible(sample), (QuantitySet{true, false, true}));
}

TEST(Plausibility, TheDefaultsAcceptATurnAndUnknownValues) {
  Plausibility sensors{PlausibilityLimits()};
  for (const double rate : {3.6e6, -3.6e6, kUnknown}) {  // 1000 deg/s
    Sample sample = thermal_sample(1, kUnknown);
    sample.rate_deg_per_h = rate;
    sample.uhfo_v = kUnknown;
    EXPECT_FALSE(sensors.implausible(sample).any()) << rate;
  }
}

// Regression: a spike exactly 1 s after the start became the reference, and the good values of 78 s were rejected.
TEST(SensorCheck, ASpikeAtTheStartIsNeverTheReference) {
  for (const int hz : {1, 2, 3, 10}) {
    for (int spike = 0; spike <= 3 * hz; ++spike) {
      SensorCheck sensor(PlausibilityLimits().temperature);
      for (int i = 0; i <= 100 * hz; ++i) {
        const bool is_plausible = sensor.check(i == spike ? 100 : 20, i * kSecondNs / hz);
        const bool has_reference = i >= std::max(hz, 2);
        ASSERT_EQ(is_plausible, i != spike || !has_reference) << hz << " Hz, spike " << spike << ", value " << i;
      }
    }
  }
}

TEST(PlausibilityLimits, StatedLimitsReplaceTheDefaults) {
  PlausibilityLimits limits;
  SensorStatements stated;
  stated.temperature.range = Range{-40, 70};
  stated.temperature.stuck_s = 600;
  stated.rate.range = Range{-100, 100};
  limits.take(stated);
  EXPECT_EQ(limits.temperature, (SensorLimits{-40, 70, 1, 2, 600}));
  EXPECT_EQ(limits.rate.high, 100);
  EXPECT_EQ(limits.uhfo, PlausibilityLimits().uhfo);
}

// The log states that a second contained an implausible value, but not which: none of its values is used.
TEST(Plausibility, AnImplausibleRowIsNotUsedAfterReadingBack) {
  CompensatedWindow row;
  row.window.second_mean.second = 1'700'000'000;
  row.window.second_mean.rate_deg_per_h = 8;
  row.window.second_mean.temperature_degc = -273;
  row.correction.quality = kImplausible;
  std::string text;
  append_csv(text, row);
  const auto read = parse_csv(text, "row");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_DOUBLE_EQ(read->window.second_mean.temperature_degc, -273);
  EXPECT_TRUE(std::isnan(without_implausible(read->window.second_mean).temperature_degc));
  EXPECT_TRUE(std::isnan(without_implausible(read->window.second_mean).rate_deg_per_h));
}

}  // namespace
}  // namespace prism::compensation
