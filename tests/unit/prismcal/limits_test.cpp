// SPDX-License-Identifier: MIT
// Limits: what is refused, what passes, and that nothing unmeasured passes.
#include "tools/prismcal/analysis/limits.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/prismcal/simulated_day.hpp"

namespace prism::prismcal {
namespace {

using testing::HasSubstr;

// bias = kDaySensitivity · T, and a standard deviation of its own.
class SureModel : public compensation::Model {
 public:
  explicit SureModel(double sd) : Model(test::linear_model(0)->info()), sd_(sd) {}
  compensation::Prediction predict(std::span<const double> inputs) const override {
    return {test::kDaySensitivity * inputs[0], sd_, sd_, false, kUnknown, {}};
  }

 private:
  double sd_;
};

TEST(Limits, AreReadWithComments) {
  const auto limits = analysis::parse_limits(R"({ "bias_stability_deg_per_h": {"max": 0.01}, // acceptance
                                        "mean_deg_per_h": {"min": -0.1, "max": 0.1} })",
                                             "limits.json")
                          .value();
  ASSERT_EQ(limits.size(), 2u);
  EXPECT_EQ(limits[0].quantity, "bias_stability_deg_per_h");
  EXPECT_FALSE(limits[0].min);
  EXPECT_EQ(limits[0].max, 0.01);
}

TEST(Limits, AreRefusedWithTheirPlace) {
  const auto said = [](const char* text) { return analysis::parse_limits(text, "l.json").error().text(); };
  EXPECT_EQ(said("[]"), "l.json: not a JSON object of limits");
  EXPECT_EQ(said("{"), "l.json: not a JSON object of limits");
  EXPECT_EQ(said("{}"), "l.json: found no limit, expected at least one");
  EXPECT_THAT(said(R"({"bias": {"max": 1}})"),
              HasSubstr("l.json:/bias: no such quantity; expected one of mean_deg_per_h"));
  EXPECT_THAT(said(R"({"mean_deg_per_h": {"maximum": 1}})"), HasSubstr("/mean_deg_per_h/maximum: unknown key"));
  EXPECT_THAT(said(R"({"mean_deg_per_h": {"max": "1"}})"), HasSubstr("/mean_deg_per_h/max: expected a number"));
  EXPECT_THAT(said(R"({"mean_deg_per_h": {}})"), HasSubstr("neither min nor max"));
  EXPECT_THAT(said(R"({"mean_deg_per_h": 3})"), HasSubstr("one or both"));
}

TEST(Limits, PassOnTheirEdgeAndFailBeyondIt) {
  const std::vector<analysis::Measured> measured = {
      {"rms_deg_per_h", "deg/h", 0.5}, {"improvement_percent", "%", 60}, {"explained_percent", "%", {}}};
  const auto pass = [&](analysis::Limit limit) { return analysis::check_limits({limit}, measured)[0].pass; };
  EXPECT_TRUE(pass({"rms_deg_per_h", {}, 0.5}));
  EXPECT_FALSE(pass({"rms_deg_per_h", {}, 0.49}));
  EXPECT_TRUE(pass({"improvement_percent", 60, {}}));
  EXPECT_FALSE(pass({"improvement_percent", 61, {}}));
  EXPECT_FALSE(pass({"explained_percent", {}, 100}));  // not measured: not passed
  EXPECT_FALSE(pass({"extrapolating_percent", {}, 100}));
}

TEST(Limits, CoverEveryQuantityOfADay) {
  const auto table =
      recordings::make_block_table(test::simulated_day(24000, 0.07, 2), {}, test::kDayEarthRate, "day").value();
  const auto judged =
      analysis::evaluate_model(test::linear_model(test::kDaySensitivity), table, {}, evaluation::Divisor::kNMinus1)
          .value();
  const auto measured = analysis::measure_all({"r1", &table, &judged, nullptr, nullptr});
  ASSERT_EQ(measured.size(), analysis::measured_names().size());
  for (const analysis::Measured& m : measured)  // this model states no standard deviation
    EXPECT_EQ(m.value.has_value(), m.quantity != "within_two_sd_percent") << m.quantity;
  EXPECT_NEAR(*measured[1].value, 0.007, 0.001);       // bias_stability
  EXPECT_NEAR(*measured[7].value, 0.07 / 60, 0.0001);  // angle random walk
}

TEST(Limits, CountWhatLiesWithinTwoOfTheModelsOwnSd) {
  const auto table =
      recordings::make_block_table(test::simulated_day(24000, 0.07, 2), {}, test::kDayEarthRate, "day").value();
  const auto covered = [&](double sd) {
    const auto judged =
        analysis::evaluate_model(std::make_shared<SureModel>(sd), table, {}, evaluation::Divisor::kNMinus1).value();
    return *analysis::measure_all({"r1", &table, &judged, nullptr, nullptr}).back().value;
  };
  EXPECT_NEAR(covered(0.007), 95.4, 3);    // the noise of a block is 0.07 / √100
  EXPECT_NEAR(covered(0.0035), 68.3, 10);  // 240 blocks
  EXPECT_EQ(covered(1), 100);
}

}  // namespace
}  // namespace prism::prismcal
