// SPDX-License-Identifier: MIT
// The slew limit of a model: derived from its box by default; engine.txt has the corrections that it limits.
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
