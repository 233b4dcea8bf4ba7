// SPDX-License-Identifier: MIT
// Blocks of a recording, and the corrections that prismd would apply to them, with a known true bias.
#include "tools/prismcal/model_evaluation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "compensation/training/trainer.hpp"
#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/findings.hpp"

namespace prism::prismcal {
namespace {

using testing::HasSubstr;

recordings::BlockTable day_table(const std::vector<compensation::SecondMean>& seconds,
                                 double earth_rate_deg_per_h = test::kDayEarthRate) {
  return recordings::make_block_table(seconds, {}, earth_rate_deg_per_h, "day").value();
}

analysis::ModelEvaluation evaluated_on(const compensation::ModelPtr& model, const recordings::BlockTable& table,
                                       const analysis::CorrectionSettings& settings = {}) {
  return analysis::evaluate_model(model, table, settings, evaluation::Divisor::kN).value();
}

// A model that needs U.
compensation::ModelPtr voltage_model() {
  compensation::ModelInfo info;
  info.name = "needs U";
  info.inputs = {"U"};
  return std::make_shared<compensation::PolynomialModel>(info, std::vector<compensation::Term>{{{1}, 1.0}});
}

TEST(BlockTable, HasOneReadyWindowPerBlock) {
  const auto second_means = test::simulated_day(8000, 0, 1);
  const auto table = day_table(second_means);
  const int warm_up = compensation::history_s({});
  EXPECT_EQ(table.size(), static_cast<std::size_t>((8000 - warm_up) / 100 + 1));
  for (std::size_t i = 1; i < table.size(); ++i) {
    EXPECT_EQ(table.blocks[i].second_mean.second - table.blocks[i - 1].second_mean.second, 100);
    EXPECT_TRUE(table.follows[i]);
  }
  EXPECT_FALSE(table.follows[0]);
  const auto temperature = table.column("T");
  for (std::size_t i = 0; i < table.size(); ++i) {
    EXPECT_NEAR(table.bias_deg_per_h[i], test::kDaySensitivity * temperature[i], 1e-9);
  }
  EXPECT_EQ(table.gaps, 0u);
  ASSERT_EQ(table.seconds.size(), 1u);
  EXPECT_EQ(table.seconds[0].values.size(), 8000u);
}

TEST(BlockTable, RestartsItsGridAfterAGap) {
  auto second_means = test::simulated_day(4000, 0, 1);
  second_means.erase(second_means.begin() + 1050, second_means.begin() + 1250);
  const auto table = day_table(second_means, 0);
  EXPECT_EQ(table.gaps, 1u);
  EXPECT_EQ(table.missing_s, 200u);
  int starts = 0;
  for (std::size_t i = 0; i < table.size(); ++i) starts += !table.follows[i];
  EXPECT_EQ(starts, 2);
  ASSERT_EQ(table.seconds.size(), 2u);
  EXPECT_EQ(table.seconds[0].values.size(), 1050u);
  EXPECT_EQ(table.seconds[1].second(0), table.seconds[0].end_s() + 200);
}

TEST(BlockTable, RejectsARecordingWithoutAFullBlock) {
  const auto second_means = test::simulated_day(90, 0, 1);
  EXPECT_THAT(recordings::make_block_table(second_means, {}, 0, "short").error().text(),
              HasSubstr("short: found 90 seconds in 1 segment, expected "));
  EXPECT_FALSE(recordings::make_block_table({}, {}, 0, "empty"));
  auto back = test::simulated_day(500, 0, 1);
  std::swap(back[100], back[101]);
  EXPECT_THAT(recordings::make_block_table(back, {}, 0, "back").error().text(), HasSubstr("out of order"));
}

TEST(ModelEvaluation, LeavesTheNoiseWithTheTrueModel) {
  const auto second_means = test::simulated_day(24000, 0.07, 2);
  const auto table = day_table(second_means);
  const auto evaluated = evaluated_on(test::linear_model(test::kDaySensitivity), table);
  EXPECT_NEAR(evaluated.stability.before.sd, 5e-4 * 40 / std::sqrt(2.0), 0.002);
  EXPECT_NEAR(evaluated.stability.after.sd, 0.007, 0.001);
  EXPECT_NEAR(evaluated.stability.after.mean, 0, 0.002);
  EXPECT_EQ(evaluated.extrapolated, 0u);
  ASSERT_TRUE(evaluated.improvement_interval);
  EXPECT_DOUBLE_EQ(evaluated.improvement_interval->value, *evaluated.stability.improvement);
  EXPECT_GT(evaluated.improvement_interval->low, 0.2) << "of 0.5";
  EXPECT_LT(evaluated.improvement_interval->high, 0.8);
}

TEST(ModelEvaluation, ReportsWhetherTwoModelsDiffer) {
  const auto table = day_table(test::simulated_day(24000, 0.07, 2));
  const auto evaluate = [&](double sensitivity) { return evaluated_on(test::linear_model(sensitivity), table); };
  const auto right = evaluate(test::kDaySensitivity), nearly = evaluate(1.01 * test::kDaySensitivity),
             zero = evaluate(0);
  const auto alike = analysis::gain_of(right, nearly, table), better = analysis::gain_of(zero, right, table),
             worse = analysis::gain_of(right, zero, table);
  ASSERT_TRUE(alike && better && worse);
  EXPECT_TRUE(alike->low < 0 && alike->high > 0) << alike->low << " to " << alike->high;
  EXPECT_GT(better->low, 0);
  EXPECT_LT(worse->high, 0);
  ASSERT_TRUE(zero.improvement_interval);
  EXPECT_TRUE(zero.improvement_interval->holds_zero());
}

TEST(ModelEvaluation, UsesEachPredictionForItsOwnBlock) {
  const auto second_means = test::simulated_day(2000, 0, 3);
  const auto table = day_table(second_means);
  const auto evaluated = evaluated_on(test::linear_model(test::kDaySensitivity), table);
  const auto seconds = evaluated.corrected_seconds_deg_per_h(table);
  // Before the first full window prismd has no bias to subtract.
  ASSERT_EQ(seconds.size(), 1u);
  EXPECT_EQ(seconds[0].start_s, table.second(0));
  EXPECT_EQ(seconds[0].end_s(), table.second(table.size() - 1) + 1);
  for (const double rate : seconds[0].values)
    EXPECT_NEAR(rate, test::kDayEarthRate, 0.002);  // half a block of a ramp of 0.03 degC/s
}

TEST(ModelEvaluation, RejectsOtherFeaturesAndMissingInputs) {
  auto second_means = test::simulated_day(2000, 0, 4);
  const auto table = day_table(second_means, 0);
  compensation::FeatureDefinition other;
  other.length_s = 50;
  EXPECT_THAT(analysis::evaluate_model(test::linear_model(1, other), table, {}, evaluation::Divisor::kN).error().text(),
              HasSubstr("found blocks with other features than model"));
  for (compensation::SecondMean& second_mean : second_means) second_mean.uhfo_v = kUnknown;
  EXPECT_THAT(
      analysis::evaluate_model(voltage_model(), day_table(second_means, 0), {}, evaluation::Divisor::kN).error().text(),
      HasSubstr("input U of model \"needs U\" is unknown in 19 of 19 blocks"));
}

TEST(ModelEvaluation, LeavesOutBlocksWithAnUnknownInput) {
  auto second_means = test::simulated_day(8000, 0, 4);
  for (std::size_t i = 4000; i < 5000; ++i) second_means[i].uhfo_v = kUnknown;
  const auto table = day_table(second_means, 0);
  const auto evaluated = evaluated_on(voltage_model(), table);
  EXPECT_THAT(evaluated.without_input, testing::AllOf(testing::Ge(9u), testing::Le(11u)));
  EXPECT_EQ(evaluated.uncorrected, evaluated.without_input);
  EXPECT_EQ(evaluated.missing_input, "U");
}

// A shift of the bias after the training changes the rms but not sigma.
TEST(ModelEvaluation, IncludesAShiftInTheRmsImprovement) {
  auto shifted = test::simulated_day(4000, 0.07, 2);
  for (compensation::SecondMean& second_mean : shifted) second_mean.rate_deg_per_h += 0.1;
  const auto table = day_table(test::simulated_day(4000, 0.07, 1), 0);
  const auto other = day_table(shifted, 0);
  const auto temperature = table.column("T");
  training::TrainingData data;
  data.names = {"T"};
  data.inputs = Eigen::Map<const Eigen::RowVectorXd>(temperature.data(), static_cast<Eigen::Index>(table.size()));
  data.target = Eigen::Map<const Eigen::VectorXd>(table.bias_deg_per_h.data(), static_cast<Eigen::Index>(table.size()));
  training::TrainingSettings settings;
  settings.method = training::find_method("lssvm");
  settings.tuning = training::Tuning::kReml;
  compensation::ModelInfo info;
  info.features = table.features;
  const auto trained = training::train(data, info, settings);
  ASSERT_TRUE(trained) << trained.error().text();
  const auto same = evaluated_on(trained->model, table);
  const auto moved = evaluated_on(trained->model, other);
  ASSERT_TRUE(same.rms_improvement && moved.rms_improvement);
  EXPECT_NEAR(*same.rms_improvement, *same.stability.improvement, 0.01);
  EXPECT_GT(*moved.stability.improvement, 0.1);
  EXPECT_LT(*moved.rms_improvement, 0.05);
}

/// Runs prismd's engine on the same seconds, as samples of one second each.
std::vector<compensation::CompensatedWindow> rows_of_prismd(const std::vector<compensation::SecondMean>& second_means,
                                                            const compensation::ModelPtr& model,
                                                            const analysis::CorrectionSettings& settings) {
  compensation::CompensationEngine engine(settings.engine);
  EXPECT_TRUE(engine.use(model, settings.fallback));
  std::vector<compensation::CompensatedWindow> rows;
  for (const compensation::SecondMean& second_mean : second_means) {
    Sample sample;
    sample.time_ns = (second_mean.second * 10 + 5) * 100'000'000;
    sample.interval_s = 1;
    sample.rate_deg_per_h = second_mean.rate_deg_per_h;
    sample.temperature_degc = second_mean.temperature_degc;
    sample.uhfo_v = second_mean.uhfo_v;
    compensation::Compensated out;
    if (const auto row = engine.push(sample, out)) rows.push_back(*row);
  }
  if (const auto row = engine.finish()) rows.push_back(*row);
  return rows;
}

/// Trained up to 40 degC of the day's 55.
compensation::ModelPtr narrow_model() {
  compensation::ModelInfo info = test::linear_model(test::kDaySensitivity)->info();
  info.domain = {{-30}, {40}};
  return std::make_shared<compensation::PolynomialModel>(info,
                                                         std::vector<compensation::Term>{{{1}, test::kDaySensitivity}});
}

// Regression: evaluate subtracted its own prediction and reported 60 % for a model that prismd clamps or rejects.
TEST(ModelEvaluation, EvaluatesWhatPrismdPublishes) {
  auto second_means = test::simulated_day(12000, 0.01, 5);
  second_means.erase(second_means.begin() + 6000, second_means.begin() + 6300);
  const auto table = day_table(second_means);
  analysis::CorrectionSettings settings;
  settings.fallback = test::linear_model(2 * test::kDaySensitivity);
  for (const auto policy : {compensation::Extrapolation::kFlag, compensation::Extrapolation::kClamp}) {
    for (const double limit : {100.0, 0.018}) {
      settings.engine = {limit, policy};
      const auto rows = rows_of_prismd(second_means, narrow_model(), settings);
      const auto evaluated = evaluated_on(narrow_model(), table, settings);
      ASSERT_EQ(rows.size(), second_means.size());
      std::size_t unknown = 0, at = 0;
      for (std::size_t i = 0; i < table.size(); ++i) {
        while (rows[at].window.second_mean.second < table.blocks[i].second_mean.second) ++at;
        const double published = rows[at].corrected_mean_deg_per_h - test::kDayEarthRate;
        unknown += std::isnan(published);
        ASSERT_EQ(std::isnan(evaluated.corrected_deg_per_h[i]), std::isnan(published)) << i;
        if (std::isnan(published)) continue;
        EXPECT_NEAR(evaluated.corrected_deg_per_h[i], published, 1e-12) << i;
      }
      EXPECT_EQ(evaluated.uncorrected, unknown);
      EXPECT_EQ(evaluated.stability.after.count, table.size() - unknown);
      // Clamped to 40 degC the bias is at most 0.02, else 0.0275.
      EXPECT_EQ(unknown > 0, limit < 1);
    }
  }
}

// The slew limit of a block step is that of the seconds between the blocks.
TEST(ModelEvaluation, LimitsTheSlewLikePrismd) {
  auto second_means = test::simulated_day(3000, 0, 8);
  for (compensation::SecondMean& second_mean : second_means)
    second_mean.temperature_degc = second_mean.second - second_means[0].second < 1500 ? 0 : 50;
  const auto table = day_table(second_means);
  const auto evaluate = [&](const compensation::SlewSettings& slew) {
    analysis::CorrectionSettings settings;
    settings.engine.slew = slew;
    return evaluated_on(test::linear_model(0.01), table, settings);
  };
  const auto limited = evaluate({true, 0.0001}), usual = evaluate({}), off = evaluate({false, {}});
  EXPECT_EQ(usual.slew_limited, 0u);
  EXPECT_EQ(off.slew_limited, 0u);
  EXPECT_EQ(usual.predicted_deg_per_h, off.predicted_deg_per_h);
  EXPECT_NEAR(off.predicted_deg_per_h.back(), 0.5, 1e-9);
  EXPECT_GT(limited.slew_limited, 10u);
  for (std::size_t i = 1; i < table.size(); ++i) {
    EXPECT_LE(std::fabs(limited.predicted_deg_per_h[i] - limited.predicted_deg_per_h[i - 1]), 0.01 + 1e-12) << i;
  }
}

// 400 s with a broken sensor are neither in a block nor in the 1 Hz series.
TEST(BlockTable, SkipsImplausibleSeconds) {
  auto second_means = test::simulated_day(3000, 0, 9);
  for (std::size_t i = 1000; i < 1400; ++i) {
    second_means[i].rate_deg_per_h = 3.4e38;
    second_means[i].temperature_degc = -273;
    second_means[i].implausible = second_means[i].all_implausible = {true, true, false};
  }
  const auto table = day_table(second_means, 0);
  for (const double degc : table.column("T")) EXPECT_GT(degc, -60);
  for (const double bias : table.bias_deg_per_h) EXPECT_LT(std::fabs(bias), 100);
  ASSERT_EQ(table.seconds.size(), 2u);
  EXPECT_EQ(table.seconds[0].values.size(), 1000u);
  EXPECT_EQ(table.seconds[1].values.size(), 1600u);
  EXPECT_EQ(table.missing_s, 400u);
  EXPECT_EQ(table.gaps, 1u);
}

// A report said that no second was missing; a thermometer that is read less often leaves no gap.
TEST(BlockTable, CountsSecondsWithoutATemperatureAsMissing) {
  auto second_means = test::simulated_day(4000, 0, 9);
  for (std::size_t i = 1000; i < 2500; ++i) second_means[i].temperature_degc = kUnknown;
  for (std::size_t i = 3000; i < 4000; ++i) {
    if (i % 4 != 0) second_means[i].temperature_degc = kUnknown;
  }
  const auto table = day_table(second_means, 0);
  EXPECT_EQ(table.missing_s, 1500u);
  EXPECT_EQ(table.unused_s, 1500u);
  EXPECT_EQ(table.gaps, 1u);
}

// It was "found no temperature", or "in 2 segments".
TEST(BlockTable, NamesOtherClocks) {
  auto second_means = test::simulated_day(1000, 0, 9);
  for (auto& second_mean : second_means) second_mean.clocks_differ = true;
  const std::string why =
      " 1000 seconds: the rate_hz of the description does not fit; correct it and replay the capture";
  EXPECT_EQ(recordings::make_block_table(second_means, {}, 0, "day").error().text(),
            "day: clocks_differ marks all" + why);
  for (std::size_t i = 0; i < 60; ++i) second_means[i].clocks_differ = false;
  EXPECT_EQ(recordings::make_block_table(second_means, {}, 0, "day").error().text(),
            "day: found 1000 seconds in 2 segments, expected 110 s without a gap for a block; clocks_differ marks 940 "
            "of" +
                why);
}

TEST(LeaveOut, NamesARangeThatEndsBeforeItBegins) {
  EXPECT_EQ(recordings::LeaveOut({"7200..3600"}).begin(0, false).error().text(),
            "--leave-out: found \"7200..3600\", which ends before it begins");
}

TEST(ModelEvaluation, UsesTheFallbackWithoutAFullWindowLikePrismd) {
  const auto second_means = test::simulated_day(1000, 0, 6);
  const auto table = day_table(second_means);
  analysis::CorrectionSettings settings;
  settings.fallback = test::linear_model(2 * test::kDaySensitivity);
  const auto model = test::linear_model(test::kDaySensitivity);
  const auto rows = rows_of_prismd(second_means, model, settings);
  const auto evaluated = evaluated_on(model, table, settings);
  const auto corrected = evaluated.corrected_seconds_deg_per_h(table);
  int by_fallback = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!(rows[i].correction.quality & compensation::kFallback)) continue;
    ++by_fallback;
    EXPECT_NEAR(recordings::value_at(corrected, second_means[i].second).value(), rows[i].corrected_deg_per_h, 1e-12)
        << i;
  }
  EXPECT_EQ(by_fallback, compensation::history_s({}) - 1);
}

TEST(ModelEvaluation, RejectsAModelAboveTheBiasLimit) {
  const auto second_means = test::simulated_day(2000, 0, 7);
  const auto table = day_table(second_means, 0);
  EXPECT_THAT(analysis::evaluate_model(test::linear_model(1000), table, {}, evaluation::Divisor::kN).error().text(),
              HasSubstr("is above 100 deg/h in"));
}

}  // namespace
}  // namespace prism::prismcal
