// SPDX-License-Identifier: MIT
// The rate of each second, with gaps.
#include "tools/prismcal/series.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "compensation/evaluation/allan.hpp"
#include "compensation/sample.hpp"

namespace prism::recordings {
namespace {

TEST(Series, KeepsEachKnownValueAndBeginsAgainAfterALongGap) {
  std::vector<Series> all;
  append(all, -6, kUnknown);
  append(all, -5, 1);
  append(all, -4, kUnknown);
  append(all, -2, 2);
  append(all, 57, 3);  // 58 s are missing
  append(all, 58, kUnknown);
  append(all, 119, 4);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].start_s, -5);
  EXPECT_EQ(all[0].values.size(), 63u);
  EXPECT_EQ(all[1].start_s, 119);
  EXPECT_EQ(all[1].end_s(), 120);
  EXPECT_EQ(value_at(all, -2), 2);
  EXPECT_EQ(value_at(all, 57), 3);
  EXPECT_EQ(value_at(all, 119), 4);
  for (const std::int64_t second : {-6, -4, -3, 58, 118, 120}) EXPECT_FALSE(value_at(all, second)) << second;
  const std::vector<double> values = joined(all);
  ASSERT_EQ(values.size(), 65u);
  EXPECT_EQ(values[63], evaluation::kAllanBreak);
  EXPECT_EQ(values[64], 4);
}

}  // namespace
}  // namespace prism::recordings
