// SPDX-License-Identifier: MIT
// The experiment: list of models, the paper's results, tables and report, with real training on a short recording.
#include "tools/prismcal/analysis/experiment.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/analysis/data_quality_table.hpp"
#include "tools/prismcal/analysis/experiment_report.hpp"
#include "tools/prismcal/analysis/paper_numbers.hpp"
#include "tools/prismcal/recordings/leave_out.hpp"
#include "tools/prismcal/report/html.hpp"
#include "tools/prismcal/report/text_output.hpp"

namespace prism::prismcal {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(PaperModels, AreThoseOfThePaperAndMore) {
  const auto specs = analysis::paper_models(true);
  int with_paper_row = 0;
  for (const analysis::ModelSpec& spec : specs) with_paper_row += analysis::paper_row(spec).has_value();
  EXPECT_EQ(with_paper_row, 3 + 2 + 12 + 16 + 1);  // tables 2, 3, 4, 5 and the unweighted row
  EXPECT_EQ(specs.size(), 34u + 11u);
  for (const analysis::ModelSpec& spec : analysis::paper_models(false))
    EXPECT_THAT(spec.inputs, Not(testing::Contains("U")));
  EXPECT_EQ(analysis::ladder_models(true).size(), 12u);
}

TEST(PaperNumbers, AgreeWithThePrintedImprovement) {
  for (const analysis::ModelSpec& spec : analysis::paper_models(true)) {
    const auto row = analysis::paper_row(spec);
    if (!row) continue;
    // The printed stability has two or three significant digits: rounding changes the improvement by 0.03 %.
    EXPECT_NEAR(row->improvement, 1 - row->after_deg_per_h / analysis::kPaperBefore, 4e-4) << spec.key();
  }
}

recordings::BlockTable day(std::uint64_t seed, const char* name) {
  return recordings::make_block_table(test::simulated_day(12000, 0.07, seed), {}, test::kDayEarthRate, name).value();
}

analysis::Experiment short_experiment() {
  const std::vector<analysis::ModelSpec> specs = {
      {"ls", {"T"}, "", ""}, {"stepwise", {"T", "dTdt"}, "", ""}, {"stepwise", {"T", "dTdt", "U"}, "", ""}};
  return analysis::run_experiment({day(1, "first"), {day(2, "again"), day(3, "third")}}, specs,
                                  evaluation::Divisor::kNMinus1, analysis::experiment_trainer({}), {})
      .value();
}

TEST(Experiment, TrainsEvaluatesAndFindsRows) {
  std::vector<std::string> received;
  const auto experiment =
      analysis::run_experiment({day(1, "first"), {day(2, "again")}}, {{"ls", {"T"}, "", ""}}, evaluation::Divisor::kN,
                               analysis::experiment_trainer({}),
                               [&](std::size_t done, std::size_t total, const std::string& next) {
                                 received.push_back(std::to_string(done) + "/" + std::to_string(total) + " " + next);
                               })
          .value();
  EXPECT_THAT(received, testing::ElementsAre("0/1 ls T", "1/1 done"));
  ASSERT_TRUE(experiment.find("ls T"));
  EXPECT_FALSE(experiment.find("ls U"));
  const analysis::ExperimentRow& row = *experiment.find("ls T");
  EXPECT_NEAR(row.evaluations[0].stability.after.sd, 0.007, 0.0015);  // 0.07 deg/h per second, 100 s means
  EXPECT_EQ(row.trained.terms.size(), 4u);
}

TEST(Experiment, DoesNotDependOnTheNumberOfThreads) {
  const analysis::ExperimentData data{day(1, "first"), {day(2, "again")}};
  const std::vector<analysis::ModelSpec> specs = {
      {"ls", {"T"}, "", ""}, {"lssvm", {"T"}, "", "reml"}, {"ls", {"U"}, "", ""}, {"ls", {"dTdt"}, "", ""}};
  const auto one =
      analysis::run_experiment(data, specs, evaluation::Divisor::kN, analysis::experiment_trainer({}), {}, 1).value();
  const auto three =
      analysis::run_experiment(data, specs, evaluation::Divisor::kN, analysis::experiment_trainer({}), {}, 3).value();
  for (std::size_t i = 0; i < specs.size(); ++i) {
    EXPECT_EQ(three.rows[i].spec.key(), specs[i].key());
    EXPECT_EQ(three.rows[i].trained.model->info().id, one.rows[i].trained.model->info().id);
    EXPECT_EQ(three.rows[i].evaluations[0].stability.after.sd, one.rows[i].evaluations[0].stability.after.sd);
  }
}

TEST(Experiment, FailsIfInterrupted) {
  const std::atomic<bool> stop{true};
  analysis::ExperimentSettings settings;
  settings.stop = &stop;
  const auto table = day(1, "first");
  const auto experiment = analysis::run_experiment({table, {table}}, {{"lssvm", {"T"}, "", "reml"}},
                                                   evaluation::Divisor::kN, analysis::experiment_trainer(settings), {});
  ASSERT_FALSE(experiment);
  EXPECT_EQ(experiment.error().text(), "lssvm T reml: tuning: interrupted");
}

TEST(ExperimentReport, ChoosesItsModelWithoutTheRepeatRun) {
  analysis::Experiment experiment = short_experiment();
  analysis::ExperimentRow row = experiment.rows[0];
  row.evaluations[0].stability.after.sd = 1;  // far worse than all others on the repeat run
  for (const char* weight : {"myriad", "huber"}) {
    row.spec = {"ir-lssvm", {"T"}, weight, "reml"};
    experiment.rows.push_back(row);
  }
  EXPECT_EQ(analysis::chosen_row(experiment)->spec.weight, "huber");
  const report::Table ladder = analysis::ladder_table(experiment);
  ASSERT_EQ(ladder.rows.size(), 4u);
  EXPECT_EQ(ladder.rows[3][0].text, "IR-LSSVM, huber");
}

TEST(Experiment, StopsAtTheFirstErrorAndNamesTheModel) {
  auto flat = test::simulated_day(4000, 0.07, 1);
  for (compensation::SecondMean& second_mean : flat) second_mean.temperature_degc = 25;
  const auto table = recordings::make_block_table(flat, {}, 0, "flat").value();
  const auto experiment = analysis::run_experiment({table, {table}}, {{"ls", {"T"}, "", ""}}, evaluation::Divisor::kN,
                                                   analysis::experiment_trainer({}), {});
  ASSERT_FALSE(experiment);
  EXPECT_EQ(experiment.error().where, "ls T");
}

// A shift of the bias after the training changes the rms but not sigma.
TEST(Experiment, IncludesAShiftInTheRmsImprovement) {
  auto shifted = test::simulated_day(4000, 0.07, 2);
  for (compensation::SecondMean& second_mean : shifted) second_mean.rate_deg_per_h += 0.1;
  const auto table = recordings::make_block_table(test::simulated_day(4000, 0.07, 1), {}, 0, "day").value();
  const auto other = recordings::make_block_table(shifted, {}, 0, "shifted").value();
  const auto experiment = analysis::run_experiment({table, {table, other}}, {{"lssvm", {"T"}, "", "reml"}},
                                                   evaluation::Divisor::kN, analysis::experiment_trainer({}), {});
  ASSERT_TRUE(experiment) << experiment.error().text();
  const auto& evaluations = experiment->rows[0].evaluations;
  ASSERT_TRUE(evaluations[0].rms_improvement && evaluations[1].rms_improvement);
  EXPECT_NEAR(*evaluations[0].rms_improvement, *evaluations[0].stability.improvement, 0.01);
  EXPECT_GT(*evaluations[1].stability.improvement, 0.1);
  EXPECT_LT(*evaluations[1].rms_improvement, 0.05);
}

TEST(ExperimentTables, IncludeThePaperResults) {
  const analysis::Experiment experiment = short_experiment();
  const report::Table table = analysis::least_squares_table(experiment);
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.rows[0][4].text, analysis::interval_text(experiment.rows[0].evaluations[0].improvement_interval));
  EXPECT_EQ(table.rows[0][5].text, "0.01194");
  EXPECT_EQ(table.rows[0][6].text, "35.46");
  EXPECT_EQ(table.rows[0][2].text, fmt::format("{:.5f}", analysis::on_repeat(experiment.rows[0]).after.sd));
  EXPECT_THAT(table.caption, HasSubstr("divisor N-1"));
  EXPECT_NEAR(*analysis::correlation_table(experiment).rows[0][1].value, 1, 0.2);
}

TEST(ExperimentReport, HasTheSameNumbersInAllFormats) {
  const analysis::Experiment experiment = short_experiment();
  bool within_limits = true;
  const std::vector<analysis::Limit> limits = {{"bias_stability_deg_per_h", {}, 0.02},
                                               {"improvement_percent", 99.9, {}}};
  report::Report report{"t",        "s", true,
                        "prismcal", {},  analysis::experiment_sections(experiment, limits, within_limits)};
  EXPECT_FALSE(within_limits);  // no model removes 99.9 %
  const auto page = report::html_page(report);
  const std::string csv = report::csv_text(report), json = report::json_text(report);
  for (const analysis::ExperimentRow& row : experiment.rows) {
    const std::string after = fmt::format("{:.5f}", analysis::on_repeat(row).after.sd);
    for (const std::string* text : {&page, &csv, &json}) EXPECT_THAT(*text, HasSubstr(after));
  }
  for (const std::string* text : {&page, &csv, &json}) {
    EXPECT_THAT(*text, HasSubstr("FAIL"));
    EXPECT_THAT(*text, HasSubstr("PASS"));
    EXPECT_THAT(*text, Not(testing::ContainsRegex("[^a-z]nan[^a-z]")));
  }
}

TEST(DataQualityTable, ReportsNothingToCompensate) {
  auto second_means = test::simulated_day(12000, 0.07, 5);
  for (compensation::SecondMean& second_mean : second_means) second_mean.temperature_degc = 25.0;
  const auto table = recordings::make_block_table(second_means, {}, test::kDayEarthRate, "room").value();
  const auto quality = analysis::check_blocks(table).value();
  EXPECT_TRUE(quality.nothing_to_compensate);
  EXPECT_THAT(analysis::data_quality_error(quality), testing::StartsWith("nothing to compensate:"));
  EXPECT_THAT(analysis::data_quality_paragraph(quality, "room").text, HasSubstr("room: nothing to compensate:"));
  EXPECT_EQ(analysis::data_quality_table(quality, "room").rows.size(), quality.findings.size());
}

// The step at the end of a block was in the block before the one that was named: some moved seconds were kept.
TEST(DataQualityTable, AdvisesToLeaveOutEverySecondAfterAMove) {
  for (const std::size_t step : {5010, 5020, 5060, 5100, 5108}) {
    auto second_means = test::simulated_day(12000, 0.07, 5);
    for (std::size_t i = step; i < second_means.size(); ++i) second_means[i].rate_deg_per_h += 3;
    const auto table = recordings::make_block_table(second_means, {}, test::kDayEarthRate, "moved").value();
    const std::string error = analysis::data_quality_error(analysis::check_blocks(table).value());
    const std::size_t begin = error.find("--leave-out ");
    ASSERT_NE(begin, std::string::npos) << error;
    const std::size_t from = begin + std::string("--leave-out ").size();
    auto leave_out = recordings::LeaveOut::parse({error.substr(from, error.find(' ', from) - from)}).value();
    ASSERT_TRUE(leave_out.begin(second_means[0].second, true));
    EXPECT_TRUE(leave_out.contains(second_means[step].second)) << step << ": " << error;
    EXPECT_FALSE(leave_out.contains(second_means[step - 210].second)) << step << ": " << error;
  }
}

}  // namespace
}  // namespace prism::prismcal
