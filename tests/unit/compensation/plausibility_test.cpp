// SPDX-License-Identifier: MIT
// Implausible values: a thermometer at −273 or 1000 degC, a jump, a rate of 3.4e38, a constant value.
#include "compensation/plausibility.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "compensation/compensated_text.hpp"
#include "compensation/compensation_engine.hpp"
#include "compensation/features.hpp"
#include "compensation/second_averager.hpp"
#include "tests/support/models.hpp"

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
  for (const double degc : {-273.0, 1000.0, -90.1, 200.1, 3.4e38, -3.4e38, HUGE_VAL, -HUGE_VAL}) {
    const QuantitySet found = sensors.implausible(thermal_sample(0.1, degc));
    EXPECT_EQ(found, (QuantitySet{false, true, false})) << degc;
  }
  Sample sample = thermal_sample(0.2, 25);
  sample.rate_deg_per_h = 3.4e38;
  EXPECT_EQ(sensors.implausible(sample), (QuantitySet{true, false, false}));
  sample.rate_deg_per_h = -3.7e7;
  sample.uhfo_v = 1e30;
  EXPECT_EQ(sensors.implausible(sample), (QuantitySet{true, false, true}));
}

TEST(Plausibility, TheDefaultsAcceptWhatGyrosDo) {
  Plausibility sensors{PlausibilityLimits()};
  // A chamber at 10 degC/min, the thermometer quantised by 1 degC, over a range of −60 to 120; a turn of 1000 deg/s.
  for (int tenth = 0; tenth < 10'800; ++tenth) {
    Sample sample = thermal_sample(0.1 * tenth, std::floor(-60 + tenth / 60.0));
    sample.rate_deg_per_h = tenth % 100 < 50 ? 3.6e6 : -3.6e6;
    ASSERT_FALSE(sensors.implausible(sample).any()) << tenth;
  }
}

TEST(Plausibility, UnknownValuesAreNotChecked) {
  Plausibility sensors{PlausibilityLimits()};
  Sample sample;
  for (sample.time_ns = 0; sample.time_ns < 10 * kSecondNs; sample.time_ns += kSecondNs)
    EXPECT_FALSE(sensors.implausible(sample).any());
}

TEST(SensorCheck, ASpikeRejectsOnlyItself) {
  SensorCheck sensor(PlausibilityLimits().temperature);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(sensor.check(i == 50 ? 45 : 25, i * kSecondNs / 10), i != 50) << i;
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

// Each value of the thermometer is in 200 frames.
TEST(SensorCheck, ARepeatedSpikeAtTheStartIsNotTheReference) {
  SensorCheck sensor(PlausibilityLimits().temperature);
  for (int i = 0; i <= 20'000; ++i) {
    const bool is_spike = i / 200 == 10;  // from 1.0 to 1.1 s
    ASSERT_EQ(sensor.check(is_spike ? 100 : 20, i * kSecondNs / 2000), !is_spike) << i;
  }
}

// Without agreement the check begins, too: with the value after the first second.
TEST(SensorCheck, ASensorThatAlternatesIsRejected) {
  SensorCheck sensor(PlausibilityLimits().temperature);
  int rejected = 0;
  for (int i = 0; i <= 110; ++i) rejected += sensor.check(i % 2 == 0 ? 20 : 100, i * kSecondNs / 10) ? 0 : 1;
  EXPECT_EQ(rejected, 50);
}

// A ramp of 1 degC/s is the limit, also from the first value on and with few values.
TEST(SensorCheck, ASteadyRampAtTheLimitIsPlausible) {
  for (const double period_s : {0.1, 1.0, 7.0}) {
    SensorCheck sensor(PlausibilityLimits().temperature);
    for (int i = 0; period_s * i < 100; ++i)
      ASSERT_TRUE(sensor.check(20 + period_s * i, std::llround(1e9 * period_s * i))) << period_s << " s, value " << i;
  }
}

// The thermometer could have reached this: 20 degC minus the step of 2 take 18 s at 1 degC/s.
TEST(SensorCheck, AJumpThatStaysIsAcceptedOnceTheSensorCouldHaveReachedIt) {
  SensorCheck sensor(PlausibilityLimits().temperature);
  std::int64_t time_ns = 0;
  for (; time_ns <= 60 * kSecondNs; time_ns += kSecondNs / 10) ASSERT_TRUE(sensor.check(25, time_ns));
  const std::int64_t jump_ns = time_ns;
  while (!sensor.check(45, time_ns)) time_ns += kSecondNs / 10;
  EXPECT_NEAR(1e-9 * static_cast<double>(time_ns - jump_ns), 18, 1.1);
  EXPECT_TRUE(sensor.check(45, time_ns + kSecondNs / 10));
}

// Many small steps are also a steep slope.
TEST(SensorCheck, ASteepRampIsDetectedWithAnyStepSize) {
  SensorCheck sensor(PlausibilityLimits().temperature);
  int refused = 0;
  for (int i = 0; i < 200; ++i) refused += !sensor.check(25 + 0.1 * i, i * kSecondNs / 100);
  EXPECT_GT(refused, 60) << "10 degC/s, with a step of 2 degC allowed";
}

// The manual of a KVH 1775 shows three frames of 40, 29 and 29 degC, 0.4 ms apart: the wrong one is unknown.
TEST(SensorCheck, TheFirstSecondHasNoReference) {
  SensorCheck sensor(PlausibilityLimits().temperature);
  EXPECT_TRUE(sensor.check(40, 0));
  EXPECT_TRUE(sensor.check(29, kSecondNs / 2500));
  for (int i = 1; i <= 20; ++i) EXPECT_TRUE(sensor.check(29, i * kSecondNs / 10));
  EXPECT_FALSE(sensor.check(40, 2 * kSecondNs));
}

TEST(SensorCheck, AConstantSensorIsStuckIfConfigured) {
  SensorLimits limits = PlausibilityLimits().temperature;
  SensorCheck usual(limits);
  limits.stuck_s = 60;
  SensorCheck sensor(limits);
  for (int i = 0; i <= 60; ++i) EXPECT_TRUE(sensor.check(25, i * kSecondNs)) << i;
  EXPECT_FALSE(sensor.check(25, 61 * kSecondNs));
  EXPECT_EQ(rejection_text(sensor.rejection(), "degC"), "found 25 degC for 61 s, expected it to change");
  EXPECT_TRUE(sensor.check(25.1, 62 * kSecondNs));
  EXPECT_TRUE(sensor.check(25.1, 122 * kSecondNs));
  for (int i = 0; i < 100'000; ++i) ASSERT_TRUE(usual.check(25, i * kSecondNs)) << "off unless configured";
}

TEST(SensorCheck, ReportsFoundAndExpectedValues) {
  SensorCheck sensor(PlausibilityLimits().temperature);
  EXPECT_TRUE(sensor.check(25, 0));
  EXPECT_TRUE(sensor.check(25, kSecondNs));
  EXPECT_FALSE(sensor.check(-273, 2 * kSecondNs));
  EXPECT_EQ(rejection_text(sensor.rejection(), "degC"), "found -273 degC, expected -90 to 200");
  EXPECT_FALSE(sensor.check(45, 3 * kSecondNs));
  EXPECT_EQ(rejection_text(sensor.rejection(), "degC"), "found 45 degC, expected 21 to 29: it was 25 2 s before");
  EXPECT_EQ(rejection_text({}, "degC"), "");
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

// A mean is over plausible values; without any, the log contains the measured mean, and windows ignore it.
TEST(SecondAverager, MeansIncludeOnlyPlausibleValues) {
  SecondAverager averager;
  const auto second = [&](int begin, double first_degc, double others_degc, bool all) {
    for (int i = 1; i <= 10; ++i) {
      const bool rejection = all || i == 1;
      averager.push(thermal_sample(begin + 0.1 * i, i == 1 ? first_degc : others_degc), {false, rejection, false});
    }
    return *averager.push(thermal_sample(begin + 1.1, 25));
  };
  const SecondMean one = second(0, 1000, 25, false);
  EXPECT_DOUBLE_EQ(one.temperature_degc, 25);
  EXPECT_EQ(one.implausible, (QuantitySet{false, true, false}));
  EXPECT_FALSE(one.all_implausible.any());
  averager = SecondAverager();
  const SecondMean none = second(0, -273, -273, true);
  EXPECT_DOUBLE_EQ(none.temperature_degc, -273);
  EXPECT_DOUBLE_EQ(none.rate_deg_per_h, 8);
  EXPECT_EQ(none.all_implausible, (QuantitySet{false, true, false}));
  EXPECT_TRUE(std::isnan(without_implausible(none).temperature_degc));
  EXPECT_DOUBLE_EQ(without_implausible(none).uhfo_v, 5);
}

TEST(FeatureExtractor, IgnoresImplausibleMeans) {
  FeatureDefinition features;
  features.length_s = 10;
  features.end_mean_s = 2;
  features.max_gap_s = 3;
  features.lag_time_constants_s = {30};
  FeatureExtractor extractor(features);
  Window window;
  const auto seconds = [&](std::int64_t from, std::int64_t to, double degc) {
    for (std::int64_t s = from; s < to; ++s) {
      SecondMean second_mean;
      second_mean.second = s;
      second_mean.rate_deg_per_h = 8;
      second_mean.temperature_degc = degc;
      second_mean.all_implausible.temperature = degc < -90;
      window = extractor.push(second_mean);
    }
  };
  seconds(0, 20, 25);
  seconds(20, 23, -273);
  EXPECT_DOUBLE_EQ(window.temperature_degc, 25) << "a short gap is bridged";
  EXPECT_DOUBLE_EQ(window.second_mean.temperature_degc, -273) << "the row contains the measured value";
  EXPECT_TRUE(window.lag_degc.empty());
  seconds(23, 24, -273);
  EXPECT_TRUE(std::isnan(window.temperature_degc)) << "a long one is not";
  EXPECT_DOUBLE_EQ(window.rate_deg_per_h, 8);
  seconds(24, 40, 25);
  EXPECT_DOUBLE_EQ(window.temperature_degc, 25);
  EXPECT_DOUBLE_EQ(window.slope_degc_per_s, 0);
  EXPECT_NEAR(window.lag_degc.at(0), 0, 1e-12);
}

using test::kFullS;
using test::short_features;

// bias = 0.01 · T: 0.25 deg/h at 25 degC, −2.73 at −273.
struct EnginePlausibility : testing::Test {
  EnginePlausibility() { use(CompensationSettings()); }

  void use(const CompensationSettings& settings) {
    engine = CompensationEngine(settings);
    const bool used = engine.use(test::linear_model({"T"}, {0.01}, 0, short_features()), nullptr).has_value();
    ASSERT_TRUE(used);
    next.rate_deg_per_h = 8;
    next.interval_s = 0.1;
    next.temperature_degc = 25;
    next.uhfo_v = 5;
  }
  void push() {
    next.time_ns += 100'000'000;
    Compensated out;
    if (const auto row = engine.push(next, out)) rows.push_back(*row);
    samples.push_back(out);
  }
  void seconds(int count) {
    samples.clear();
    rows.clear();
    for (int i = 0; i < 10 * count; ++i) push();
  }
  /// Pushes the seconds as above, and one more sample that closes the last of them.
  void whole_seconds(int count) {
    seconds(count);
    push();
    rows.erase(rows.begin());
  }

  CompensationEngine engine;
  Sample next;
  std::vector<Compensated> samples;
  std::vector<CompensatedWindow> rows;
};

TEST_F(EnginePlausibility, AnImpossibleTemperatureIsNotGoodAndDoesNotChangeTheBias) {
  for (const double degc : {-273.0, 1000.0, 45.0}) {
    use({});
    seconds(30);
    ASSERT_EQ(rows.back().correction.quality, kGood);
    next.temperature_degc = degc;
    seconds(12);
    for (const Compensated& sample : samples) {
      EXPECT_TRUE(sample.correction.quality & kImplausible) << quality_text(sample.correction.quality);
      EXPECT_TRUE(std::isnan(sample.correction.bias_deg_per_h) ||
                  std::fabs(sample.correction.bias_deg_per_h - 0.25) < 1e-12);
      EXPECT_EQ(sample.sample.temperature_degc, degc) << "the sample contains the measured value";
    }
    for (std::size_t i = 1; i < rows.size(); ++i) {
      EXPECT_TRUE(rows[i].correction.quality & kImplausible) << i;
      EXPECT_DOUBLE_EQ(rows[i].window.second_mean.temperature_degc, degc) << "and the row too";
    }
    EXPECT_EQ(rows.back().correction.quality, kInputMissing | kImplausible);
    EXPECT_TRUE(std::isnan(rows.back().corrected_deg_per_h));
    EXPECT_TRUE(rows.back().rejections.temperature);
    EXPECT_FALSE(rows.back().rejections.rate);
    next.temperature_degc = 25;
    seconds(2 * kFullS);
    EXPECT_EQ(rows.back().correction.quality, kGood);
    EXPECT_DOUBLE_EQ(rows.back().correction.bias_deg_per_h, 0.25);
    EXPECT_FALSE(rows.back().rejections.temperature);
  }
}

TEST_F(EnginePlausibility, ASpikeFlagsOnlyItsSampleAndItsRow) {
  seconds(30);
  seconds(0);
  for (int i = 1; i <= 30; ++i) {
    next.temperature_degc = i == 15 ? 1000 : 25;
    push();
    EXPECT_EQ(samples.back().correction.quality, i == 15 ? kImplausible : kGood) << i;
  }
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].correction.quality, kGood);
  EXPECT_EQ(rows[1].correction.quality, kGood);
  EXPECT_EQ(rows[2].correction.quality, kImplausible);
  EXPECT_DOUBLE_EQ(rows[2].window.second_mean.temperature_degc, 25);
  EXPECT_DOUBLE_EQ(rows[2].correction.bias_deg_per_h, 0.25);
  EXPECT_EQ(rows[2].rejections.temperature.found, 1000);
}

TEST_F(EnginePlausibility, AnImpossibleRateIsNotCorrected) {
  seconds(30);
  next.rate_deg_per_h = 3.4e38;
  whole_seconds(2);
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    EXPECT_EQ(samples[i].correction.quality, kImplausible);
    EXPECT_TRUE(std::isnan(samples[i].corrected_deg_per_h));
    EXPECT_DOUBLE_EQ(samples[i].correction.bias_deg_per_h, 0.25);
  }
  const CompensatedWindow& row = rows.back();
  EXPECT_EQ(row.correction.quality, kImplausible);
  EXPECT_NEAR(row.window.second_mean.rate_deg_per_h, 3.4e38, 1e24);
  EXPECT_TRUE(std::isnan(row.corrected_deg_per_h));
  EXPECT_DOUBLE_EQ(row.window.rate_deg_per_h, 8) << "the window ignores it";
  EXPECT_DOUBLE_EQ(row.corrected_mean_deg_per_h, 8 - 0.25);
  next.rate_deg_per_h = HUGE_VAL;
  whole_seconds(2);
  EXPECT_TRUE(rows.back().correction.quality & kImplausible);
}

TEST_F(EnginePlausibility, AStuckThermometerIsImplausibleIfConfigured) {
  CompensationSettings settings;
  settings.plausibility.temperature.stuck_s = 20;
  use(settings);
  seconds(20);
  EXPECT_EQ(samples.back().correction.quality, kGood);
  seconds(10);
  EXPECT_EQ(rows.back().correction.quality, kInputMissing | kImplausible);
  next.temperature_degc = 25.01;
  whole_seconds(1);
  EXPECT_FALSE(rows.back().correction.quality & kImplausible);
}

TEST_F(EnginePlausibility, ANewSessionResetsTheChecks) {
  seconds(30);
  engine.finish();
  engine.reset();
  next.temperature_degc = 60;
  seconds(20);
  for (const Compensated& sample : samples) EXPECT_FALSE(sample.correction.quality & kImplausible);
  EXPECT_EQ(samples.back().correction.quality, kGood);
  EXPECT_DOUBLE_EQ(samples.back().correction.bias_deg_per_h, 0.6);
}

// The log states that a second contained an implausible value, but not which: none of its values is used.
TEST_F(EnginePlausibility, AnImplausibleRowIsNotUsedAfterReadingBack) {
  seconds(30);
  next.temperature_degc = -273;
  whole_seconds(2);
  std::string text;
  append_csv(text, rows.back());
  EXPECT_NE(text.find("-273.00000"), std::string::npos) << text;
  EXPECT_NE(text.find(",implausible,"), std::string::npos) << text;
  const auto row = parse_csv(text, "row");
  ASSERT_TRUE(row) << row.error().text();
  EXPECT_DOUBLE_EQ(row->window.second_mean.temperature_degc, -273);
  EXPECT_TRUE(std::isnan(without_implausible(row->window.second_mean).temperature_degc));
  EXPECT_TRUE(std::isnan(without_implausible(row->window.second_mean).rate_deg_per_h));
}

}  // namespace
}  // namespace prism::compensation
