// SPDX-License-Identifier: MIT
// The data-quality check and the doubts about a faulty recording: errors and their advice.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/findings.hpp"
#include "tools/prismcal/model_evaluation.hpp"

namespace prism::analysis {
namespace {

using testing::HasSubstr;

TEST(DataQualityTable, ReportsNothingToCompensate) {
  auto second_means = test::simulated_day(12000, 0.07, 5);
  for (compensation::SecondMean& second_mean : second_means) second_mean.temperature_degc = 25.0;
  const auto table = recordings::make_block_table(second_means, {}, test::kDayEarthRate, "room").value();
  const auto quality = analysis::check_blocks(table).value();
  EXPECT_TRUE(quality.nothing_to_compensate);
  EXPECT_THAT(analysis::data_quality_error(quality), testing::StartsWith("nothing to compensate:"));
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
    recordings::LeaveOut leave_out({error.substr(from, error.find(' ', from) - from)});
    ASSERT_TRUE(leave_out.begin(second_means[0].second, true));
    EXPECT_TRUE(leave_out.contains(second_means[step].second)) << step << ": " << error;
    EXPECT_FALSE(leave_out.contains(second_means[step - 210].second)) << step << ": " << error;
  }
}

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> doubts_of(const std::vector<compensation::SecondMean>& day) {
  const auto table = recordings::make_block_table(day, {}, test::kDayEarthRate, "day").value();
  const auto evaluated =
      evaluate_model(test::linear_model(test::kDaySensitivity), table, {}, evaluation::Divisor::kNMinus1).value();
  return recording_doubts(table, evaluated, {});
}

TEST(RecordingDoubts, ThereAreNoneOfAGoodDay) {
  auto day = test::simulated_day(24000, 0.01, 1);
  EXPECT_THAT(doubts_of(day), IsEmpty());
  for (auto& second : day) second.rate_deg_per_h += 0.3;  // a turn-on offset
  EXPECT_THAT(doubts_of(day), IsEmpty());
}

TEST(RecordingDoubts, NameAStep) {
  auto day = test::simulated_day(24000, 0.01, 1);
  for (std::size_t i = 12000; i < day.size(); ++i) day[i].rate_deg_per_h += 0.2;
  EXPECT_THAT(doubts_of(day), ElementsAre(HasSubstr("was the gyro moved")));
}

TEST(RecordingDoubts, NameTheOtherSign) {
  auto day = test::simulated_day(24000, 0.01, 1);
  for (auto& second : day) second.rate_deg_per_h = -second.rate_deg_per_h;
  EXPECT_THAT(doubts_of(day), ElementsAre(HasSubstr("the opposite of the model's (correlation -1.00)"),
                                          HasSubstr("with the other sign of the rate it would be 0.007")));
}

TEST(RecordingDoubts, NameAnotherMean) {
  auto day = test::simulated_day(24000, 0.01, 1);
  for (auto& second : day) second.rate_deg_per_h -= 2 * test::kDayEarthRate;
  EXPECT_THAT(
      doubts_of(day),
      ElementsAre(HasSubstr(
          "with the other sign of the rate it would be -0.007444, with that of the Earth rate (elevation) 0.007")));
  for (auto& second : day) second.rate_deg_per_h += test::kDayEarthRate;
  EXPECT_THAT(doubts_of(day), ElementsAre(HasSubstr("unit and sign those of the training?")));
}

TEST(DataQualityOfBlocks, NamesARateThatIsRoundedMoreCoarselyThanItsNoise) {
  auto day = test::simulated_day(24000, 0.01, 1);
  const auto quantised = [&] {
    const auto quality = check_blocks(recordings::make_block_table(day, {}, 0, "day").value()).value();
    return data_quality_error(quality);
  };
  EXPECT_EQ(quantised(), "");
  for (auto& second : day) {
    const double drift = 200 * (second.rate_deg_per_h - test::kDayEarthRate);
    second.rate_deg_per_h = std::round(0.2 * drift);  // 2 deg/h of drift in steps of 1
  }
  EXPECT_THAT(quantised(), HasSubstr("not usable for training: quantised 1 deg/h; the rate changes in steps"));
}

TEST(UnitCheck, NamesTheUnitInWhichTheMeanIsTheEarthRate) {
  constexpr double kEarth = 8.4652, kRadPerS = 206264.80625;
  EXPECT_EQ(recordings::likely_unit(kEarth / kRadPerS, kEarth), "rad/s");
  EXPECT_EQ(recordings::likely_unit(1.2 * kEarth / 3600, kEarth), "deg/s");
  EXPECT_EQ(recordings::likely_unit(-kEarth / 3600, -kEarth), "deg/s");
  EXPECT_EQ(recordings::likely_unit(0.9 * kEarth * 3600, kEarth), "deg/h");
  EXPECT_EQ(recordings::likely_unit(-kEarth * kRadPerS, -kEarth), "deg/h");
  for (const double plausible : {kEarth, 0.8 * kEarth, 1.25 * kEarth, 120.0, -300.0, 0.0, 20'000.0})
    EXPECT_FALSE(recordings::likely_unit(plausible, kEarth)) << plausible;
  EXPECT_FALSE(recordings::likely_unit(0.1 / kRadPerS, 0.1)) << "the bias may be larger than this Earth rate";
}

TEST(SignQuestion, IsAskedIfTheMeanIsTheEarthRateWithTheOtherSign) {
  EXPECT_FALSE(recordings::sign_question(8.48, 8.47));
  EXPECT_EQ(recordings::sign_question(-8.48, 8.47)->line(),
            "the mean rate is -8.48 deg/h, the site's Earth rate 8.47 deg/h: has the rate or the elevation the wrong "
            "sign?");
  EXPECT_FALSE(recordings::sign_question(-11.48, 8.47)) << "so large a bias explains any mean";
}

}  // namespace
}  // namespace prism::analysis
