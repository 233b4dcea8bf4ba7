// SPDX-License-Identifier: MIT
// Blocks of time: their start, the effect of a gap, and the counts of left-out rows.
#include "compensation/evaluation/block_means.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace prism::evaluation {
namespace {

std::vector<TimedValue> seconds(int from, int to) {
  std::vector<TimedValue> rows;
  for (int t = from; t <= to; ++t) rows.push_back({static_cast<double>(t), static_cast<double>(t)});
  return rows;
}

TEST(BlockMeans, AreAdjacentAndExcludeTheIncompleteEnd) {
  const BlockMeans blocks = mean_over_blocks(seconds(1, 25), 1, 10, 5, "x").value();
  ASSERT_EQ(blocks.mean.size(), 2u);
  EXPECT_DOUBLE_EQ(blocks.mean[0], 5.5);
  EXPECT_DOUBLE_EQ(blocks.mean[1], 15.5);
  EXPECT_DOUBLE_EQ(blocks.time_s[0], 10);
  EXPECT_DOUBLE_EQ(blocks.time_s[1], 20);
  EXPECT_FALSE(blocks.follows[0]);
  EXPECT_TRUE(blocks.follows[1]);
  EXPECT_EQ(blocks.rows, 20u);
  EXPECT_EQ(blocks.rows_left, 5u);
}

TEST(BlockMeans, RestartAfterAGap) {
  std::vector<TimedValue> rows = seconds(1, 14);
  const auto later = seconds(31, 50);
  rows.insert(rows.end(), later.begin(), later.end());
  const BlockMeans blocks = mean_over_blocks(rows, 1, 10, 5, "x").value();
  ASSERT_EQ(blocks.mean.size(), 3u);
  EXPECT_DOUBLE_EQ(blocks.mean[1], 35.5);  // 31 to 40: without a restart the grid would be 31 to 40 only by chance
  EXPECT_DOUBLE_EQ(blocks.mean[2], 45.5);
  EXPECT_FALSE(blocks.follows[1]);
  EXPECT_TRUE(blocks.follows[2]);
  EXPECT_EQ(blocks.gaps, 1u);
  EXPECT_DOUBLE_EQ(blocks.longest_gap_s, 16);
  EXPECT_EQ(blocks.rows_left, 4u);
}

TEST(BlockMeans, RestartTheGridEvenIfTheOldOneHadOtherEdges) {
  std::vector<TimedValue> rows = seconds(1, 10);
  const auto later = seconds(34, 43);
  rows.insert(rows.end(), later.begin(), later.end());
  const BlockMeans blocks = mean_over_blocks(rows, 1, 10, 5, "x").value();
  ASSERT_EQ(blocks.mean.size(), 2u);
  EXPECT_DOUBLE_EQ(blocks.mean[1], 38.5);
}

TEST(BlockMeans, CountUnknownRowsAndBridgeShortGaps) {
  std::vector<TimedValue> rows = seconds(1, 20);
  rows[4].value = std::nan("");
  const BlockMeans blocks = mean_over_blocks(rows, 1, 10, 5, "x").value();
  ASSERT_EQ(blocks.mean.size(), 2u);
  EXPECT_DOUBLE_EQ(blocks.mean[0], (55.0 - 5.0) / 9);
  EXPECT_EQ(blocks.rows_unknown, 1u);
  EXPECT_EQ(blocks.gaps, 0u);
}

TEST(BlockMeans, AreNotNeighboursAcrossABlockWithTooFewRows) {
  std::vector<TimedValue> rows = seconds(1, 30);
  rows.erase(rows.begin() + 11, rows.begin() + 18);  // 12 to 18
  const BlockMeans blocks = mean_over_blocks(rows, 1, 10, 10, "x").value();
  ASSERT_EQ(blocks.mean.size(), 2u);
  EXPECT_DOUBLE_EQ(blocks.time_s[1], 30);
  EXPECT_FALSE(blocks.follows[1]);
  EXPECT_EQ(blocks.gaps, 0u);
}

TEST(BlockMeans, AcceptRowsWithRoundedTimes) {
  std::vector<TimedValue> rows;
  for (int i = 1; i <= 400; ++i) rows.push_back({0.505 * i + (i % 2 ? 0.004 : -0.004), 1.0});
  const BlockMeans blocks = mean_over_blocks(rows, 0.505, 10.1, 2, "x").value();
  EXPECT_EQ(blocks.mean.size(), 20u);
  EXPECT_EQ(blocks.rows, 400u);
}

TEST(BlockMeans, RejectInvalidRecords) {
  EXPECT_EQ(mean_over_blocks({}, 1, 10, 5, "log.csv").error().text(),
            "log.csv: found no value in 0 rows, expected at least one");
  const std::vector<TimedValue> unknown = {{1, std::nan("")}, {2, std::nan("")}};
  EXPECT_FALSE(mean_over_blocks(unknown, 1, 10, 5, "x"));
  const std::vector<TimedValue> back = {{2, 0}, {1, 0}};
  EXPECT_EQ(mean_over_blocks(back, 1, 10, 5, "x").error().text(),
            "x: time of row 1 is not after that of the row before");
  EXPECT_FALSE(mean_over_blocks(seconds(1, 5), 1, 0.5, 5, "x"));
}

}  // namespace
}  // namespace prism::evaluation
