// SPDX-License-Identifier: MIT
// Blocks of a recording, and what a model does to them, where the true bias is known.
#include "tools/prismcal/analysis/judgement.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/prismcal/simulated_day.hpp"

namespace prism::prismcal {
namespace {

using testing::HasSubstr;

TEST(BlockTable, IsThePapersGridOfReadyWindows) {
  const auto buckets = test::simulated_day(8000, 0, 1);
  const recordings::BlockTable table = recordings::make_block_table(buckets, {}, test::kDayEarthRate, "day").value();
  const int warm_up = compensation::history_s({});
  EXPECT_EQ(table.size(), static_cast<std::size_t>((8000 - warm_up) / 100 + 1));
  for (std::size_t i = 1; i < table.size(); ++i) {
    EXPECT_EQ(table.blocks[i].bucket.second - table.blocks[i - 1].bucket.second, 100);
    EXPECT_TRUE(table.follows[i]);
  }
  EXPECT_FALSE(table.follows[0]);
  const auto temperature = table.column("T");
  for (std::size_t i = 0; i < table.size(); ++i) {
    EXPECT_NEAR(table.bias_deg_per_h[i], test::kDaySensitivity * temperature[i], 1e-9);
  }
  EXPECT_EQ(table.gaps, 0u);
  EXPECT_EQ(table.second_bias_deg_per_h.size(), 8000u);
}

TEST(BlockTable, BeginsItsGridAnewAfterAGapAndCountsIt) {
  auto buckets = test::simulated_day(4000, 0, 1);
  buckets.erase(buckets.begin() + 1050, buckets.begin() + 1250);
  const recordings::BlockTable table = recordings::make_block_table(buckets, {}, 0, "day").value();
  EXPECT_EQ(table.gaps, 1u);
  EXPECT_EQ(table.missing_s, 200u);
  int starts = 0;
  for (std::size_t i = 0; i < table.size(); ++i) starts += !table.follows[i];
  EXPECT_EQ(starts, 2);
  // The hole stands in the 1 Hz series, a long one cut to a minute.
  EXPECT_EQ(table.second_bias_deg_per_h.size(), 3800u + 60u);
}

TEST(BlockTable, RefusesWhatHoldsNoFullBlock) {
  const auto buckets = test::simulated_day(90, 0, 1);
  EXPECT_THAT(recordings::make_block_table(buckets, {}, 0, "short").error().text(),
              HasSubstr("short: 90 seconds in 1 stretches hold no full block"));
  EXPECT_FALSE(recordings::make_block_table({}, {}, 0, "empty"));
  auto back = test::simulated_day(500, 0, 1);
  std::swap(back[100], back[101]);
  EXPECT_THAT(recordings::make_block_table(back, {}, 0, "back").error().text(), HasSubstr("does not come after"));
}

TEST(Judgement, OfTheTrueModelLeavesTheNoise) {
  const auto buckets = test::simulated_day(24000, 0.07, 2);
  const recordings::BlockTable table = recordings::make_block_table(buckets, {}, test::kDayEarthRate, "day").value();
  const analysis::Judgement judged =
      analysis::judge(*test::linear_model(test::kDaySensitivity), table, evaluation::Divisor::kN).value();
  EXPECT_NEAR(judged.stability.before.sd, 5e-4 * 40 / std::sqrt(2.0), 0.002);
  EXPECT_NEAR(judged.stability.after.sd, 0.007, 0.001);
  EXPECT_NEAR(judged.stability.after.mean, 0, 0.002);
  EXPECT_EQ(judged.extrapolated, 0u);
}

TEST(Judgement, HoldsEachPredictionOverItsOwnBlock) {
  const auto buckets = test::simulated_day(2000, 0, 3);
  const recordings::BlockTable table = recordings::make_block_table(buckets, {}, test::kDayEarthRate, "day").value();
  const analysis::Judgement judged =
      analysis::judge(*test::linear_model(test::kDaySensitivity), table, evaluation::Divisor::kN).value();
  const auto seconds = analysis::corrected_seconds(judged, table);
  ASSERT_EQ(seconds.size(), 2000u);
  const std::int64_t first_end = table.blocks[0].bucket.second;
  for (std::size_t i = 0; i < 2000; ++i) {
    const bool inside = table.second[i] > first_end - 100 && table.second[i] <= table.blocks.back().bucket.second;
    EXPECT_EQ(std::isfinite(seconds[i]), inside) << i;
    if (!inside) continue;
    EXPECT_NEAR(seconds[i], 0, 0.002);  // half a block of a ramp of 0.03 degC/s
  }
}

TEST(Judgement, RefusesFeaturesAndInputsThatDoNotFit) {
  auto buckets = test::simulated_day(2000, 0, 4);
  const recordings::BlockTable table = recordings::make_block_table(buckets, {}, 0, "day").value();
  compensation::FeatureDefinition other;
  other.length_s = 50;
  EXPECT_THAT(analysis::judge(*test::linear_model(1, other), table, evaluation::Divisor::kN).error().text(),
              HasSubstr("were not made by the features"));
  for (compensation::Bucket& bucket : buckets) bucket.uhfo_v = kUnknown;
  compensation::ModelInfo info;
  info.name = "needs U";
  info.inputs = {"U"};
  const compensation::PolynomialModel model(info, {{{1}, 1.0}});
  EXPECT_THAT(
      analysis::judge(model, recordings::make_block_table(buckets, {}, 0, "day").value(), evaluation::Divisor::kN)
          .error()
          .text(),
      HasSubstr("does not carry an input of model \"needs U\" (U)"));
}

}  // namespace
}  // namespace prism::prismcal
