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

}  // namespace
}  // namespace prism::analysis
