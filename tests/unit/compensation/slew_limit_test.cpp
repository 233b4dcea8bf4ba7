// SPDX-License-Identifier: MIT
// The slew limit: derived from the model's box by default, not applied to a first correction, flagged if it acts.
#include <gtest/gtest.h>

#include <cmath>

#include "compensation/compensation_engine.hpp"
#include "compensation/plausibility.hpp"
#include "tests/support/models.hpp"

namespace prism::compensation {
namespace {

using test::linear_model;

using test::short_features;

// 0.01 deg/h per degC over 100 degC: a span of 1 deg/h, so at most 4 · 1 / 10 = 0.4 deg/h per second.
ModelPtr boxed(double gain = 0.01) { return linear_model({"T"}, {gain}, 0, short_features(), {{-30}, {70}}); }
constexpr double kMost = 0.4;

Window window_at(std::int64_t second, double degc) {
  Window window;
  window.second_mean.second = second;
  window.temperature_degc = degc;
  window.warm_s = history_s(short_features());
  return window;
}

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

TEST(CompensationEngine, FollowsAStepWithinTheSlewLimit) {
  CompensationEngine engine;
  ASSERT_TRUE(engine.use(boxed(), nullptr));
  EXPECT_DOUBLE_EQ(engine.follow(window_at(100, 20)).bias_deg_per_h, 0.2) << "the first is not limited";
  // 13.6 deg/h more in one row.
  const Correction held = engine.follow(window_at(101, 1380));
  EXPECT_NEAR(held.bias_deg_per_h, 0.2 + kMost, 1e-12);
  EXPECT_EQ(held.quality, kExtrapolating | kSlewLimited);
  EXPECT_NEAR(engine.follow(window_at(103, 1380)).bias_deg_per_h, 0.2 + 3 * kMost, 1e-12) << "two seconds, two steps";
  const Correction back = engine.follow(window_at(104, 20));
  EXPECT_NEAR(back.bias_deg_per_h, 0.2 + 2 * kMost, 1e-12);
  EXPECT_EQ(back.quality, kSlewLimited);
  engine.follow(window_at(105, 20));
  engine.follow(window_at(106, 20));
  const Correction there = engine.follow(window_at(107, 20));
  EXPECT_DOUBLE_EQ(there.bias_deg_per_h, 0.2);
  EXPECT_EQ(there.quality, kGood);
}

// The fastest change in the training box: all of it in one window.
TEST(CompensationEngine, TheSlewLimitAllowsEveryChangeInTheTrainingBox) {
  CompensationEngine engine;
  ASSERT_TRUE(engine.use(boxed(), nullptr));
  for (int s = 0; s <= 10; ++s) EXPECT_EQ(engine.follow(window_at(s, -30 + 10 * s)).quality, kGood) << s;
}

TEST(CompensationEngine, TheFirstCorrectionIsNotLimited) {
  CompensationEngine engine;
  ASSERT_TRUE(engine.use(boxed(), nullptr));
  engine.follow(window_at(0, 20));
  EXPECT_EQ(engine.follow(window_at(1, kUnknown)).quality, kInputMissing);
  EXPECT_DOUBLE_EQ(engine.follow(window_at(2, 65)).bias_deg_per_h, 0.65) << "after an unknown one";
  engine.break_off();
  EXPECT_DOUBLE_EQ(engine.follow(window_at(3, -20)).bias_deg_per_h, -0.2) << "after a break";
  ASSERT_TRUE(engine.use(boxed(0.1), nullptr));
  EXPECT_DOUBLE_EQ(engine.follow(window_at(4, 20)).bias_deg_per_h, 2) << "from another model";
}

TEST(CompensationEngine, TheSlewLimitMayBeSetOrSwitchedOff) {
  for (const bool limited : {true, false}) {
    CompensationSettings settings;
    settings.slew = {limited, limited ? std::optional(0.001) : std::nullopt};
    CompensationEngine engine(settings);
    ASSERT_TRUE(engine.use(boxed(), nullptr));
    engine.follow(window_at(0, 20));
    const Correction next = engine.follow(window_at(1, 70));
    EXPECT_NEAR(next.bias_deg_per_h, limited ? 0.201 : 0.7, 1e-12);
    EXPECT_EQ(next.quality, limited ? kSlewLimited : kGood);
  }
}

// The fallback is used until the window is full; then the model starts at its own prediction, not at the fallback's.
TEST(CompensationEngine, TheModelAfterItsFallbackIsNotLimited) {
  CompensationEngine engine;
  ASSERT_TRUE(engine.use(boxed(0.1), boxed(0.01)));
  Window warming = window_at(0, 20);
  warming.warm_s = 5;
  EXPECT_NEAR(engine.follow(warming).bias_deg_per_h, 0.2, 1e-12);
  EXPECT_NEAR(engine.follow(window_at(1, 20)).bias_deg_per_h, 2, 1e-12);
}

}  // namespace
}  // namespace prism::compensation
