// SPDX-License-Identifier: MIT
// Splitting a recording into training and held-out blocks: their distance, their contents, and errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/training_set.hpp"

namespace prism::recordings {
namespace {

BlockTable day(const compensation::FeatureDefinition& features = {}) {
  return *make_block_table(test::simulated_day(20000, 0.1, 3), features, test::kDayEarthRate, "day");
}

std::set<std::int64_t> ends(const BlockTable& table) {
  std::set<std::int64_t> seconds;
  for (std::size_t i = 0; i < table.size(); ++i) seconds.insert(table.second(i));
  return seconds;
}

/// Shortest distance of a training and a held-out block, from the end of one to the start of the other, s.
std::int64_t nearest(const Split& split) {
  std::int64_t min_s = 1'000'000;
  for (const std::int64_t a : ends(split.training)) {
    for (const std::int64_t b : ends(split.held_out)) min_s = std::min(min_s, std::abs(a - b) - 100);
  }
  return min_s;
}

TEST(HoldOut, ParsesAShareOrSegments) {
  EXPECT_EQ(parse_hold_out("0.5")->share, 0.5);
  EXPECT_EQ(parse_hold_out("0.5")->text(), "the last 50 %");
  EXPECT_EQ(parse_hold_out("blocks:600")->segment_s, 600);
  for (const char* text :
       {"", "0", "1", "0.96", "50%", "blocks:", "blocks:0", "blocks:1.5", "blocks:nan", "nan", "0.5 "}) {
    const auto found = parse_hold_out(text);
    ASSERT_FALSE(found) << text;
    EXPECT_EQ(found.error().where, "--hold-out");
  }
}

TEST(HoldOut, HoldsOutTheLastHalfAtLeastAWindowAfterTheFirst) {
  const BlockTable table = day();
  const auto split = split_blocks(table, {0.5, 0});
  ASSERT_TRUE(split);
  EXPECT_LT(*ends(split->training).rbegin(), *ends(split->held_out).begin());
  EXPECT_GE(nearest(*split), 100);
  EXPECT_LE(split->between, 2u);
  EXPECT_EQ(split->training.size() + split->held_out.size() + split->between, table.size());
  EXPECT_NEAR(static_cast<double>(split->held_out.size()), static_cast<double>(table.size()) / 2, 2);
}

TEST(HoldOut, AlternatesSegmentsAWindowApart) {
  const auto split = split_blocks(day(), {0, 600});
  ASSERT_TRUE(split);
  EXPECT_GE(nearest(*split), 100);
  EXPECT_NEAR(static_cast<double>(split->held_out.size()) / static_cast<double>(split->training.size()), 4. / 6, 0.05);
  EXPECT_LT(*ends(split->held_out).begin(), *ends(split->training).rbegin());
  EXPECT_FALSE(split->held_out.follows.front());
  EXPECT_EQ(std::count(split->held_out.follows.begin(), split->held_out.follows.end(), true),
            static_cast<std::ptrdiff_t>(split->held_out.size() * 3 /
                                        4));  // four per segment; the first does not follow a block
}

TEST(HoldOut, CopiesOnlyTheSecondsOfItsBlocks) {
  const auto split = split_blocks(day(), {0.3, 0});
  ASSERT_TRUE(split);
  ASSERT_EQ(split->held_out.seconds.size(), 1u);
  EXPECT_EQ(split->held_out.seconds[0].values.size(), split->held_out.size() * 100);
  EXPECT_GE(split->held_out.seconds[0].start_s, split->training.seconds.back().end_s() + 99);
}

TEST(HoldOut, RejectsShortSegmentsAndPartsWithoutBlocks) {
  const auto narrow = split_blocks(day(), {0, 299});
  ASSERT_FALSE(narrow);
  EXPECT_NE(narrow.error().what.find("expected 300 s or more"), std::string::npos);
  const BlockTable table = *make_block_table(test::simulated_day(500, 0.1, 3), {}, test::kDayEarthRate, "short");
  EXPECT_FALSE(split_blocks(table, {0.1, 0}));
}

}  // namespace
}  // namespace prism::recordings
