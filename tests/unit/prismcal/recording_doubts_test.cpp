// SPDX-License-Identifier: MIT
// A faulty recording is doubted before the model.
#include "tools/prismcal/analysis/recording_doubts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/analysis/data_quality_table.hpp"

namespace prism::analysis {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> doubts_of(const std::vector<compensation::SecondMean>& day,
                                   std::optional<double> training_mean = std::nullopt) {
  const auto table = recordings::make_block_table(day, {}, test::kDayEarthRate, "day").value();
  auto evaluated =
      evaluate_model(test::linear_model(test::kDaySensitivity), table, {}, evaluation::Divisor::kNMinus1).value();
  evaluated.training_mean_deg_per_h = training_mean;
  return recording_doubts(table, evaluated, {});
}

TEST(RecordingDoubts, ThereAreNoneOfAGoodDay) {
  EXPECT_THAT(doubts_of(test::simulated_day(24000, 0.01, 1)), IsEmpty());
  EXPECT_THAT(doubts_of(test::simulated_day(24000, 0.01, 1), 0.3), IsEmpty()) << "a turn-on offset";
}

TEST(RecordingDoubts, NameAStep) {
  auto day = test::simulated_day(24000, 0.01, 1);
  for (std::size_t i = 12000; i < day.size(); ++i) day[i].rate_deg_per_h += 0.2;
  EXPECT_THAT(doubts_of(day), ElementsAre(HasSubstr("was the gyro moved")));
}

TEST(RecordingDoubts, NameTheOtherSign) {
  auto day = test::simulated_day(24000, 0.01, 1);
  for (auto& second : day) second.rate_deg_per_h = -second.rate_deg_per_h;
  EXPECT_THAT(doubts_of(day, 0.0075), ElementsAre(HasSubstr("the opposite of the model's (correlation -1.00)"),
                                                  HasSubstr("with the other sign of the rate it would be 0.007")));
  EXPECT_THAT(doubts_of(day), ElementsAre(HasSubstr("opposite"), HasSubstr("the site's Earth rate 8.47")));
}

TEST(RecordingDoubts, NameAnotherMean) {
  auto day = test::simulated_day(24000, 0.01, 1);
  for (auto& second : day) second.rate_deg_per_h -= 2 * test::kDayEarthRate;
  EXPECT_THAT(
      doubts_of(day, 0.0075),
      ElementsAre(HasSubstr(
          "with the other sign of the rate it would be -0.007444, with that of the Earth rate (elevation) 0.007")));
  for (auto& second : day) second.rate_deg_per_h += test::kDayEarthRate;
  EXPECT_THAT(doubts_of(day, 0.0075), ElementsAre(HasSubstr("are Earth rate, unit and sign the same in both?")));
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

}  // namespace
}  // namespace prism::analysis
