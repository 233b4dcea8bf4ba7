// SPDX-License-Identifier: MIT
// A rate per second with gaps.
#include "tools/prismcal/recordings/second_series.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "compensation/sample.hpp"

namespace prism::recordings {
namespace {

using Pairs = std::vector<std::pair<std::int64_t, double>>;

void expect_equal(const Pairs& pairs) {
  SecondSeries series;
  for (const auto& [second, rate] : pairs) series.push(second, rate);
  ASSERT_EQ(series.size(), pairs.size());
  EXPECT_EQ(series.first_second(), pairs.front().first);
  EXPECT_EQ(series.last_second(), pairs.back().first);
  std::size_t i = 0;
  const auto bits = [](double value) { return std::isnan(value) ? 0 : std::bit_cast<std::uint64_t>(value); };
  series.for_each([&](std::int64_t second, double rate) {
    ASSERT_EQ(second, pairs[i].first);
    ASSERT_EQ(series.second(i), second);
    ASSERT_EQ(bits(rate), bits(pairs[i].second)) << i;
    ASSERT_EQ(bits(series.rate(i)), bits(rate)) << i;
    ASSERT_EQ(series.find(second), i++);
  });
  EXPECT_EQ(i, pairs.size());
  EXPECT_FALSE(series.find(pairs.back().first + 1));
  EXPECT_FALSE(series.find(pairs.front().first - 1));
}

TEST(SecondSeries, KeepsEachValueAndSecond) {
  std::mt19937 random(1);
  Pairs pairs;
  std::int64_t second = -5;
  for (int i = 0; i < 10'000; ++i) {
    second += i % 1000 == 7 ? 60 : 1;
    pairs.emplace_back(second, i % 300 == 11 ? kUnknown : std::uniform_real_distribution<>(-1, 1)(random));
  }
  expect_equal(pairs);
  expect_equal({{0, kUnknown}, {2, -2147.483648}});
}

TEST(SecondSeries, FindsNoSecondOfAGap) {
  SecondSeries series;
  for (const std::int64_t second : {10, 11, 15}) series.push(second, 1);
  EXPECT_EQ(series.find(11), 1u);
  EXPECT_FALSE(series.find(12));
  EXPECT_EQ(series.find(15), 2u);
}

}  // namespace
}  // namespace prism::recordings
