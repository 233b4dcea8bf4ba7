// SPDX-License-Identifier: MIT
// Limits: parsing and its errors, checks, and values that could not be measured.
#include "tools/prismcal/analysis/limits.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/prismcal/simulated_day.hpp"

namespace prism::prismcal {
namespace {

using testing::HasSubstr;

// bias = kDaySensitivity · T, with a given standard deviation.
class ModelWithSd : public compensation::Model {
 public:
  explicit ModelWithSd(double sd) : Model(test::linear_model(0)->info()), sd_(sd) {}
  compensation::Prediction predict(std::span<const double> inputs) const override {
    return {test::kDaySensitivity * inputs[0], sd_, sd_, false, kUnknown, {}};
  }

 private:
  double sd_;
};

TEST(Limits, AllowComments) {
  const auto limits = analysis::parse_limits(R"({ "bias_stability_deg_per_h": {"max": 0.01}, // acceptance
                                        "mean_deg_per_h": {"min": -0.1, "max": 0.1} })",
                                             "limits.json")
                          .value();
  ASSERT_EQ(limits.size(), 2u);
  EXPECT_EQ(limits[0].quantity, "bias_stability_deg_per_h");
  EXPECT_FALSE(limits[0].min);
  EXPECT_EQ(limits[0].max, 0.01);
}

TEST(Limits, AreRejectedWithAJsonPointer) {
  const auto error_of = [](const char* text) { return analysis::parse_limits(text, "l.json").error().text(); };
  EXPECT_EQ(error_of("[]"), "l.json: not a JSON object of limits");
  EXPECT_EQ(error_of("{"), "l.json: not a JSON object of limits");
  EXPECT_EQ(error_of("{}"), "l.json: found no limit, expected at least one");
  EXPECT_THAT(error_of(R"({"bias": {"max": 1}})"),
              HasSubstr("l.json:/bias: no such quantity; expected one of mean_deg_per_h"));
  EXPECT_THAT(error_of(R"({"mean_deg_per_h": {"maximum": 1}})"), HasSubstr("/mean_deg_per_h/maximum: unknown key"));
  EXPECT_THAT(error_of(R"({"mean_deg_per_h": {"max": "1"}})"),
              HasSubstr("/mean_deg_per_h/max: found \"1\", expected a number"));
  EXPECT_THAT(error_of(R"({"mean_deg_per_h": {}})"), HasSubstr("neither min nor max"));
  EXPECT_THAT(error_of(R"({"mean_deg_per_h": 3})"), HasSubstr("one or both"));
}

TEST(Limits, PassOnTheirEdgeAndFailOutside) {
  const std::vector<analysis::Measured> measured = {
      {"rms_deg_per_h", "deg/h", 0.5}, {"improvement_percent", "%", 60}, {"explained_percent", "%", {}}};
  const auto pass = [&](analysis::Limit limit) { return analysis::check_limits({limit}, measured)[0].pass; };
  EXPECT_TRUE(pass({"rms_deg_per_h", {}, 0.5}));
  EXPECT_FALSE(pass({"rms_deg_per_h", {}, 0.49}));
  EXPECT_TRUE(pass({"improvement_percent", 60, {}}));
  EXPECT_FALSE(pass({"improvement_percent", 61, {}}));
  EXPECT_FALSE(pass({"explained_percent", {}, 100}));  // not measured
  EXPECT_FALSE(pass({"extrapolating_percent", {}, 100}));
}

TEST(Limits, MeasureAllQuantities) {
  const auto table =
      recordings::make_block_table(test::simulated_day(24000, 0.07, 2), {}, test::kDayEarthRate, "day").value();
  const auto evaluated =
      analysis::evaluate_model(test::linear_model(test::kDaySensitivity), table, {}, evaluation::Divisor::kNMinus1)
          .value();
  const auto measured = analysis::measure_all({"r1", &table, &evaluated, nullptr});
  ASSERT_EQ(measured.size(), analysis::measured_names().size());
  for (const analysis::Measured& m : measured)  // this model states no standard deviation
    EXPECT_EQ(m.value.has_value(), m.quantity != "within_two_sd_percent") << m.quantity;
  EXPECT_NEAR(*measured[1].value, 0.007, 0.001);       // bias_stability
  EXPECT_NEAR(*measured[7].value, 0.07 / 60, 0.0001);  // angle random walk
}

TEST(Limits, MeasureCoverageByTheModelsSd) {
  const auto table =
      recordings::make_block_table(test::simulated_day(24000, 0.07, 2), {}, test::kDayEarthRate, "day").value();
  const auto covered = [&](double sd) {
    const auto evaluated =
        analysis::evaluate_model(std::make_shared<ModelWithSd>(sd), table, {}, evaluation::Divisor::kNMinus1).value();
    return *analysis::measure_all({"r1", &table, &evaluated, nullptr}).back().value;
  };
  EXPECT_NEAR(covered(0.007), 95.4, 3);    // the noise of a block is 0.07 / √100
  EXPECT_NEAR(covered(0.0035), 68.3, 10);  // 240 blocks
  EXPECT_EQ(covered(1), 100);
}

}  // namespace
}  // namespace prism::prismcal
