// SPDX-License-Identifier: MIT
// Engine with faulty sensors. In the field a thermometer reported −273 degC, the row was `good`, and the bias −9.75
// deg/h.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "compensation/compensated_text.hpp"
#include "compensation/compensation_engine.hpp"
#include "tests/support/models.hpp"

namespace prism::compensation {
namespace {

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
