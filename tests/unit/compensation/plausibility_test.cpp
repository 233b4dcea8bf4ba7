// SPDX-License-Identifier: MIT
// The limits of plausible values and of the slew of a bias; sensor_checks.txt and engine.txt have their effect.
#include "compensation/plausibility.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "compensation/compensated_text.hpp"
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

using test::linear_model;
using test::short_features;

// 0.01 deg/h per degC over 100 degC: a span of 1 deg/h, so at most 4 · 1 / 10 = 0.4 deg/h per second.
ModelPtr boxed(double gain = 0.01) { return linear_model({"T"}, {gain}, 0, short_features(), {{-30}, {70}}); }
constexpr double kMost = 0.4;

TEST(BiasSpan, IsTheSpanOverTheTrainingBox) {
  EXPECT_NEAR(boxed()->bias_span_deg_per_h(), 1, 1e-12);
  const auto plane = linear_model({"T", "dTdt", "U"}, {0.01, -2, 0.5}, 7, {}, {{-30, -0.1, 5}, {70, 0.1, 6}});
  EXPECT_NEAR(plane->bias_span_deg_per_h(), 1 + 0.4 + 0.5, 1e-12) << "the grid includes the corners";
  EXPECT_TRUE(std::isnan(linear_model({"T"}, {0.01})->bias_span_deg_per_h())) << "no box";
  EXPECT_EQ(boxed(0)->bias_span_deg_per_h(), 0);
}

// A bump in the middle of the box, 0 at its corners: T(1 − T) over 0 to 1.
TEST(BiasSpan, IncludesTheInsideOfTheBox) {
  ModelInfo info;
  info.kind = "polynomial";
  info.inputs = {"T", "U"};
  info.domain = {{0, 0}, {1, 1}};
  const PolynomialModel model(info, {{{1, 0}, 1}, {{2, 0}, -1}});
  EXPECT_NEAR(model.bias_span_deg_per_h(), 0.25, 0.001);
}

TEST(BiasSpan, SupportsTenInputsAndNoMore) {
  const auto wide = [](std::size_t inputs) {
    ModelInfo info;
    info.kind = "polynomial";
    info.inputs.assign(inputs, "T");
    info.domain = {std::vector<double>(inputs, 0), std::vector<double>(inputs, 1)};
    std::vector<Term> terms;
    for (std::size_t i = 0; i < inputs; ++i) {
      terms.push_back({std::vector<int>(inputs, 0), 1});
      terms.back().powers[i] = 1;
    }
    return PolynomialModel(info, terms).bias_span_deg_per_h();
  };
  for (std::size_t inputs = 1; inputs <= 10; ++inputs) EXPECT_NEAR(wide(inputs), static_cast<double>(inputs), 1e-12);
  EXPECT_TRUE(std::isnan(wide(11)));
}

TEST(GreatestSlew, IsThatOfTheModelUnlessConfigured) {
  EXPECT_NEAR(greatest_slew_deg_per_h_per_s(*boxed(), {}, 100), kMost, 1e-12);
  EXPECT_NEAR(greatest_slew_deg_per_h_per_s(*boxed(), {}, 0.1), 4 * 0.2 / 10, 1e-12) << "limited to the accepted range";
  EXPECT_NEAR(greatest_slew_deg_per_h_per_s(*linear_model({"T"}, {0.01}), {}, 100), 4 * 200 / 100.0, 1e-12);
  EXPECT_EQ(greatest_slew_deg_per_h_per_s(*boxed(), {true, 0.25}, 100), 0.25);
  EXPECT_TRUE(std::isinf(greatest_slew_deg_per_h_per_s(*boxed(), {false, {}}, 100)));
  EXPECT_EQ(greatest_slew_deg_per_h_per_s(*boxed(0), {}, 100), kLeastSlew);
}

}  // namespace
}  // namespace prism::compensation
