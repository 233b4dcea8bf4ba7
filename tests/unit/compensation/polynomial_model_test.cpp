// SPDX-License-Identifier: MIT
// Polynomial models compared with hand calculations: the paper's equations as shipped, and small ones.
#include "compensation/polynomial_model.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "compensation/model_text.hpp"
#include "tests/support/models.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::compensation {
namespace {

constexpr double kRounding = 1e-15;  // sums of nine doubles below 4

ModelPtr shipped(const std::string& name) {
  const auto path = std::filesystem::path(PRISM_SOURCE_DIR) / "config" / "models" / name;
  auto model = parse_model(test::read_file(path), name);
  EXPECT_TRUE(model) << model.error().text();
  return model ? *model : nullptr;
}

double bias(const ModelPtr& model, std::vector<double> inputs) { return model->predict(inputs).bias_deg_per_h; }

// T = 25 degC, dT/dt = 0.01 degC/s, term by term of equation 23:
//   -0.001427
//   +0.0004906   · 25        = +0.012265
//   -0.000004616 · 625       = -0.002885
//   -0.917       · 0.01      = -0.00917
//   -57.349      · 0.0001    = -0.0057349
//   -0.01926     · 25 · 0.01 = -0.004815
//                        sum = -0.0117669
// At T = 0 and dT/dt = 0 only the constant remains.
TEST(ShippedModels, Model1IsEquation23) {
  const ModelPtr model = shipped("tao2019-model1.json");
  ASSERT_TRUE(model);
  EXPECT_EQ(model->info().inputs, (std::vector<std::string>{"T", "dTdt"}));
  EXPECT_EQ(model->info().kind, "stepwise");
  EXPECT_NEAR(bias(model, {25, 0.01}), -0.0117669, kRounding);
  EXPECT_EQ(bias(model, {0, 0}), -0.001427);
}

// T = 20 degC, dT/dt = -0.01 degC/s, U = 5.25 V, term by term of equation 25:
//   -1.565
//   +0.008292    · 20           = +0.16584
//   +0.000005529 · 400          = +0.0022116
//   +26.263      · -0.01        = -0.26263
//   +0.646       · 5.25         = +3.3915
//   -0.06494     · 27.5625      = -1.78990875
//   -0.04055     · 20 · -0.01   = +0.00811
//   -0.001562    · 20 · 5.25    = -0.16401
//   -4.666       · -0.01 · 5.25 = +0.244965
//                           sum = +0.03107785
TEST(ShippedModels, Model2IsEquation25) {
  const ModelPtr model = shipped("tao2019-model2.json");
  ASSERT_TRUE(model);
  EXPECT_EQ(model->info().inputs, (std::vector<std::string>{"T", "dTdt", "U"}));
  EXPECT_NEAR(bias(model, {20, -0.01, 5.25}), 0.03107785, 4 * kRounding);
  EXPECT_EQ(bias(model, {0, 0, 0}), -1.565);
}

TEST(ShippedModels, UseTheSamplingOfThePaperAndFitAnyGyro) {
  for (const char* name : {"tao2019-model1.json", "tao2019-model2.json"}) {
    const ModelPtr model = shipped(name);
    ASSERT_TRUE(model);
    EXPECT_EQ(model->info().features, FeatureDefinition{}) << name;
    EXPECT_EQ(model->info().gyro_serial, "") << name;
    EXPECT_FALSE(model->predict(std::vector<double>(model->info().inputs.size(), 1000)).extrapolating) << name;
  }
}

// 2 - 3 x + 5 x³ at x = -2: 2 + 6 - 40 = -32 (the paper's equation 21 has this form).
TEST(PolynomialModel, TakesAnyPowerOfOneInput) {
  ModelInfo info;
  info.kind = "polynomial";
  info.inputs = {"T"};
  const PolynomialModel model(info, {{{0}, 2}, {{1}, -3}, {{3}, 5}});
  EXPECT_EQ(model.predict(std::vector<double>{-2}).bias_deg_per_h, -32);
  EXPECT_TRUE(std::isnan(model.predict(std::vector<double>{-2}).sd_deg_per_h));
}

TEST(PolynomialModel, WithoutTermsIsZero) {
  ModelInfo info;
  info.kind = "polynomial";
  info.inputs = {"T"};
  EXPECT_EQ(PolynomialModel(info, {}).predict(std::vector<double>{25}).bias_deg_per_h, 0);
}

TEST(PolynomialModel, TheDomainIsClosedAndIncludesEveryInput) {
  const ModelPtr model = test::linear_model({"T", "U"}, {0, 0}, 1, {}, Domain{{-40, 5}, {70, 6}});
  EXPECT_FALSE(model->predict(std::vector<double>{-40, 5}).extrapolating);
  EXPECT_FALSE(model->predict(std::vector<double>{70, 6}).extrapolating);
  EXPECT_TRUE(model->predict(std::vector<double>{-40.001, 5.5}).extrapolating);
  EXPECT_TRUE(model->predict(std::vector<double>{70.001, 5.5}).extrapolating);
  EXPECT_TRUE(model->predict(std::vector<double>{25, 4.999}).extrapolating);
  EXPECT_TRUE(model->predict(std::vector<double>{25, 6.001}).extrapolating);
}

TEST(GatherInputs, ReturnsThemInTheOrderOfTheModelOrNothing) {
  const ModelPtr model = test::linear_model({"U", "T"}, {1, 1});
  Window window;
  window.temperature_degc = 25;
  EXPECT_TRUE(gather_inputs(*model, window).empty());
  window.uhfo_v = 5.25;
  EXPECT_EQ(gather_inputs(*model, window), (std::vector<double>{5.25, 25}));
}

}  // namespace
}  // namespace prism::compensation
