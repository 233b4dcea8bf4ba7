// SPDX-License-Identifier: MIT
// The simple checksums compared with sums computed by hand.
#include "drivers/wire/description/check.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace prism::wire {
namespace {

TEST(Sums, AddWordsInTheirOrderAndPadTheLast) {
  const std::vector<std::uint8_t> data = {0x01, 0x02, 0xFF, 0xFF, 0x10};
  EXPECT_EQ(word_sum(data, 1, false), 0x01u + 0x02 + 0xFF + 0xFF + 0x10);
  EXPECT_EQ(word_sum(data, 2, false), 0x0201u + 0xFFFF + 0x0010);
  EXPECT_EQ(word_sum(data, 2, true), 0x0102u + 0xFFFF + 0x1000);
  EXPECT_EQ(word_sum(data, 4, true), 0x0102FFFFu + 0x10000000);
  EXPECT_EQ(word_xor(data, 1, false), 0x01u ^ 0x02 ^ 0x10);
}

TEST(Sums, FletcherHasTwoRunningSums) {
  const std::vector<std::uint8_t> data = {1, 2, 250};  // sums 1 3 253, sums of them 1 4 257
  EXPECT_EQ(fletcher_256(data), 253 << 8 | 1);
}

}  // namespace
}  // namespace prism::wire
