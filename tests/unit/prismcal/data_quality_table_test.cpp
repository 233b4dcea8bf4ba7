// SPDX-License-Identifier: MIT
// The data-quality check of a recording: its errors and their advice.
#include "tools/prismcal/analysis/data_quality_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/recordings/leave_out.hpp"

namespace prism::prismcal {
namespace {

using testing::HasSubstr;

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
