// SPDX-License-Identifier: MIT
// Sentences about a model: the first of `prismcal train`, those below tables and figures, and the limits that it has to
// keep.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "compensation/training/trainer.hpp"
#include "tests/support/blocks.hpp"
#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/limits.hpp"
#include "tools/prismcal/recording_report.hpp"
#include "tools/prismcal/training_run.hpp"

namespace prism::commands {
namespace {

using testing::EndsWith, testing::HasSubstr, testing::StartsWith;

/// A bias of 400 samples in two recordings with different means; the errors are half of it.
training::TrainingData two_recordings() {
  training::TrainingData data;
  data.target.resize(400);
  std::mt19937_64 random(5);
  std::normal_distribution<double> bias(0, 0.02);
  for (Eigen::Index i = 0; i < 400; ++i) {
    data.target[i] = bias(random) + (i < 200 ? 1 : 2);
    data.runs.push_back(i < 200 ? 0 : 1);
  }
  return data;
}

training::HeldOutErrors half_of(const training::TrainingData& data) {
  training::HeldOutErrors held;
  held.error.resize(400);
  for (Eigen::Index i = 0; i < 400; ++i) {
    held.error[i] = 0.5 * (data.target[i] - (i < 200 ? 1 : 2));
    held.folds.push_back(static_cast<int>(i / 40));
    held.samples.push_back(i);
  }
  held.model_variance = Eigen::VectorXd::Zero(400);
  return held;
}

TEST(Readiness, ExpectsWhatHeldOutPartsShow) {
  const auto data = two_recordings();
  const auto expected = expectation_of(half_of(data), data);
  ASSERT_TRUE(expected && expected->improvement);
  EXPECT_EQ(expected->parts, 10);
  EXPECT_NEAR(expected->explained, 0.75, 1e-6) << "the means of the recordings do not count";
  EXPECT_NEAR(expected->improvement->value, 0.5, 1e-6);
  EXPECT_LT(expected->improvement->low, 1 - 0.5 * std::exp(0.36)) << "another day differs more than parts of one day";
  EXPECT_GT(expected->improvement->high, 1 - 0.5 * std::exp(-0.36));
  auto perfect = half_of(data);
  perfect.error *= 1e-20;
  EXPECT_EQ(expectation_of(perfect, data)->improvement->low, 1);
  const auto json = expectation_json(expected);
  EXPECT_NEAR(json["improvement_percent"].get<double>(), 50, 1e-4);
  EXPECT_TRUE(expectation_json(std::nullopt).is_null());
}

TEST(Readiness, ExpectsNothingWithoutHeldOutParts) {
  const auto data = two_recordings();
  EXPECT_FALSE(expectation_of({}, data)) << "the recording is too short";
  auto failed = half_of(data);
  failed.error[3] = NAN;
  EXPECT_FALSE(expectation_of(failed, data));
}

TEST(Readiness, SentenceNamesTheNextStepOrTheReason) {
  const auto data = two_recordings();
  auto expected = expectation_of(half_of(data), data);
  training::TrainedModel trained;
  trained.samples.fitted = data.target;
  evaluation::DataQuality quality;
  std::vector<std::string> questions;
  Attempts tried{.method = "composite", .inputs = "T, dTdt", .others = {{"stepwise", -0.2}, {"ir-lssvm", -0.1}}};
  const auto sentence = [&] {
    return first_sentence(judge(trained, expected, quality, questions, [&] { return tried; }), expected, quality,
                          "prismcal evaluate m.json ANOTHER-RECORDING --out report");
  };
  EXPECT_THAT(sentence(), StartsWith("ready: explains 75 % of held-out variation, expected improvement 50 % ("));
  EXPECT_THAT(sentence(),
              EndsWith(" %); data quality: pass; next: prismcal evaluate m.json ANOTHER-RECORDING --out report\n"));
  quality.verdict = evaluation::Verdict::kWarn;
  quality.findings = {{"length", evaluation::Verdict::kWarn, 150, "blocks", {200, 20}}};
  EXPECT_THAT(sentence(), HasSubstr("; data quality: warn (length 150 blocks, expected at least 200); next: "));
  quality.verdict = evaluation::Verdict::kRefuse;
  EXPECT_THAT(sentence(), StartsWith("not ready: the data quality fails, --force was given: "));
  quality = {};
  questions = {"temperature jumped from 25.0 to 45.0 degC at 7001 s and stayed: a fault, or true?"};
  EXPECT_THAT(sentence(), StartsWith("doubtful: temperature jumped from 25.0 to 45.0 degC at 7001 s and stayed: "));
  questions.clear();
  expected->improvement->low = -0.1;
  EXPECT_THAT(sentence(), StartsWith("doubtful: it may also be no improvement: "));
  expected->explained = -0.05;
  EXPECT_THAT(sentence(), StartsWith("not ready: held-out parts of the recording get worse with it: tried composite, "
                                     "stepwise, ir-lssvm with T, dTdt; a longer cycle would not help: add inputs"));
  tried.longer_helps = true;
  tried.inputs += " and a response of 63 min";
  EXPECT_THAT(sentence(), HasSubstr("with T, dTdt and a response of 63 min; record a longer or wider cycle; "));
  tried.longer_helps = false;
  tried.others[0].second = 0.36;
  EXPECT_THAT(sentence(), HasSubstr("stepwise predicts held-out parts better and explains 36 % of them (composite: -5 %"
                                    "): train with --method stepwise; "));
  EXPECT_THAT(sentence(), Not(HasSubstr("next:")));
  expected.reset();
  EXPECT_THAT(sentence(),
              StartsWith("not ready: 400 samples are too few to test the model on parts of the recording: "));
}

// bias = kDaySensitivity · T, with a given standard deviation.
class ModelWithSd : public compensation::Model {
 public:
  explicit ModelWithSd(double sd) : Model(test::linear_model(0)->info(), ""), sd_(sd) {}
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
  for (const test::Block& row : test::blocks("prismcal/limit_errors.txt", 2))
    EXPECT_THAT(error_of(row[0].c_str()), HasSubstr(row[1])) << row.where;
}

TEST(Limits, PassOnTheirEdgeAndFailOutside) {
  const std::vector<analysis::Measured> measured = {{"rms_deg_per_h", "deg/h", 0.5},
                                                    {"improvement_percent", "%", 60},
                                                    {"explained_percent", "%", {}},
                                                    {"bias_instability_deg_per_h", "deg/h", 0.01, true}};
  const auto pass = [&](analysis::Limit limit) { return analysis::check_limits({limit}, measured)[0].pass; };
  EXPECT_TRUE(pass({"rms_deg_per_h", {}, 0.5}));
  EXPECT_FALSE(pass({"rms_deg_per_h", {}, 0.49}));
  EXPECT_TRUE(pass({"improvement_percent", 60, {}}));
  EXPECT_FALSE(pass({"improvement_percent", 61, {}}));
  EXPECT_FALSE(pass({"explained_percent", {}, 100}));  // not measured
  EXPECT_FALSE(pass({"extrapolating_percent", {}, 100}));
  EXPECT_TRUE(pass({"bias_instability_deg_per_h", {}, 0.01}));  // an upper bound
  EXPECT_FALSE(pass({"bias_instability_deg_per_h", 0.001, {}}));
}

TEST(Limits, TableMarksUpperBoundsAndNamesTheRecordingsThatFail) {
  const std::vector<analysis::Limit> limits = {{"bias_instability_deg_per_h", {}, 0.01}};
  const auto checks = [&](double bound) {
    return analysis::check_limits(limits, {{"bias_instability_deg_per_h", "deg/h", bound, true}});
  };
  const report::Table table = analysis::limits_table({{"a", checks(0.005)}, {"b", checks(0.02)}});
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0][5].text, "≤ 0.005");
  EXPECT_EQ(table.rows[0][6].text, "PASS");
  EXPECT_EQ(table.rows[1][6].text, "FAIL");
  EXPECT_EQ(table.meaning, "FAIL: 1 of 2 limits: bias_instability_deg_per_h on b.");
}

TEST(Limits, MeasureAllQuantities) {
  const auto table =
      recordings::make_block_table(test::simulated_day(24000, 0.07, 2), {}, test::kDayEarthRate, "day").value();
  const auto evaluated =
      analysis::evaluate_model(test::linear_model(test::kDaySensitivity), table, {}, evaluation::Divisor::kNMinus1)
          .value();
  const auto measured = analysis::measure_all(analysis::evaluate_recording("r1", {{}, table}, evaluated));
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
    return *analysis::measure_all(analysis::evaluate_recording("r1", {{}, table}, evaluated)).back().value;
  };
  EXPECT_NEAR(covered(0.007), 95.4, 3);    // the noise of a block is 0.07 / √100
  EXPECT_NEAR(covered(0.0035), 68.3, 10);  // 240 blocks
  EXPECT_EQ(covered(1), 100);
}

using evaluation::ThermalKind;
using testing::HasSubstr;

TEST(Meanings, OfBiasStability) {
  evaluation::BiasStability s;
  EXPECT_THAT(analysis::stability_meaning(s), HasSubstr("nothing to remove"));
  s.improvement = -0.1;
  EXPECT_THAT(analysis::stability_meaning(s), HasSubstr("do not use it for such recordings."));
  EXPECT_THAT(analysis::stability_meaning(s, true), HasSubstr("unless the recording is at fault"));
  s.improvement = 0.5;
  s.floor_deg_per_h = 0.006;
  s.explained = 0.97;
  s.after.sd = 0.0065;
  EXPECT_THAT(analysis::stability_meaning(s), HasSubstr("almost only white noise (0.00600 deg/h)"));
  s.after.sd = 0.018;  // most of a large drift is removed, and three times the noise is left
  EXPECT_THAT(analysis::stability_meaning(s),
              HasSubstr("removes 97.0 % of the drift's variance above the white noise"));
  EXPECT_THAT(analysis::stability_meaning(s), HasSubstr("The rest, 0.01800 deg/h, is 3.0 times that noise"));
}

TEST(Meanings, OfSoaksAndRamps) {
  const std::vector<ThermalKind> kinds = {ThermalKind::kSoak, ThermalKind::kSoak, ThermalKind::kHeating,
                                          ThermalKind::kCooling};
  const std::vector<double> large = {9, -9, 9, -9};
  EXPECT_THAT(analysis::segments_meaning(kinds, large, {1, -1, 1, -1}),
              HasSubstr("as good while the temperature changes as at rest"));
  EXPECT_THAT(analysis::segments_meaning(kinds, large, {1, -1, 3, -3}),
              HasSubstr("weaker while the temperature changes"));
  EXPECT_THAT(analysis::segments_meaning(kinds, large, {3, -3, 1, -1}), HasSubstr("weaker at constant temperature"));
  EXPECT_THAT(analysis::segments_meaning(kinds, large, {1, -1, 3, -3}, 39.4),
              HasSubstr("39 % of the recording are outside the training, so this says little"));
  EXPECT_THAT(analysis::segments_meaning(kinds, {1, -1, 1, -1}, {3, -3, 3, -3}),
              HasSubstr("the model makes both worse"));
  EXPECT_THAT(analysis::segments_meaning({kinds[0], kinds[1]}, {9, -9}, {1, -1}), HasSubstr("only soaks"));
}

TEST(Meanings, OfTheLoop) {
  EXPECT_THAT(analysis::loop_meaning({}, 0.02, true), HasSubstr("cannot be judged"));
  EXPECT_THAT(analysis::loop_meaning(0.1, 0.02, true), EndsWith("up to 0.1 deg/h before and 0.02 deg/h after."));
  EXPECT_THAT(analysis::loop_meaning(0.02, 0.1, false), HasSubstr("needs dTdt as input, or a response"));
  EXPECT_THAT(analysis::loop_meaning(0.02, 0.1, true), HasSubstr("in the training they differed in another way"));
}

TEST(Meanings, OfTheAllanDeviation) {
  const auto meaning = [](const std::vector<double>& tau_s, const std::vector<double>& first,
                          const std::vector<double>& second) {
    return analysis::allan_curve_meaning({.name = "", .x = tau_s, .y = first}, {.name = "", .x = tau_s, .y = second});
  };
  EXPECT_THAT(
      meaning({1, 10, 100}, {3, 1, 2}, {3, 1, 0.5}),
      HasSubstr("most at averages of 100 s: 0.5 instead of 2 deg/h; in averages below 100 s the noise dominates"));
  EXPECT_THAT(meaning({1, 10}, {3, 1}, {3, 1}), HasSubstr("does not change"));
  EXPECT_THAT(meaning({1, 10}, {3, 1}, {3, 2}),
              HasSubstr("makes the rate worse, most at averages of 10 s: 2 instead of 1"));
  EXPECT_THAT(meaning({1, 10, 100}, {3, 1, 1}, {3, 2, 0.5}),
              HasSubstr("most at averages of 100 s: 0.5 instead of 1 deg/h; in averages below 100 s"));
  EXPECT_THAT(meaning({1, 10, 100}, {3, 1, 1}, {3, 2, 0.5}), HasSubstr("it makes it worse, most at averages of 10 s"));
  evaluation::AllanCoefficients before, after;
  before[1].value = 0.001;
  after[1].value = 0.00101;
  after[2].value = 0.002;
  EXPECT_THAT(analysis::allan_meaning(before, after), HasSubstr("adds no noise"));
  EXPECT_THAT(analysis::allan_meaning(before, after),
              HasSubstr("0.002 deg/h was there before, hidden by the thermal drift"));
  after[1].value = 0.0012;
  EXPECT_THAT(analysis::allan_meaning(before, after), HasSubstr("rises by 20 %"));
}

TEST(Meanings, OfTheResidual) {
  evaluation::Autocorrelation r{std::vector<double>(61, 0.01), 0.06};
  r.coefficient[0] = 1;
  EXPECT_THAT(analysis::residual_meaning(r, 100), HasSubstr("0 of 60 lags are outside the lines, as with white noise"));
  for (std::size_t i = 1; i <= 18; ++i) r.coefficient[i] = 0.4;
  EXPECT_THAT(analysis::residual_meaning(r, 100),
              HasSubstr("18 of 60 lags are outside the lines: about 40 % (variance) of the residual is a drift that "
                        "changes over about 1900 s"));
  for (std::size_t i = 1; i <= 60; ++i) r.coefficient[i] = 0.4;
  EXPECT_THAT(analysis::residual_meaning(r, 100), HasSubstr("changes over more than 1.7 h"));
}

}  // namespace
}  // namespace prism::commands
