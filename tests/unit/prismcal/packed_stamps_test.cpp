// SPDX-License-Identifier: MIT
// Stamps are read as they were written, whatever their steps.
#include "tools/prismcal/recordings/packed_stamps.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace prism::prismcal {
namespace {

using recordings::PackedStamps;

/// Stamps with a regular step, jitter of `jitter_bits` bits, and now and then a hole.
std::vector<std::int64_t> stamps_with(unsigned jitter_bits, std::size_t rows) {
  std::mt19937_64 random(jitter_bits);
  std::vector<std::int64_t> stamps;
  std::int64_t time = 1'700'000'000'000'000'000;
  for (std::size_t i = 0; i < rows; ++i) {
    time += random() % 100 == 0 ? 70'000'000 : 10'000'000;
    stamps.push_back(time + static_cast<std::int64_t>(random() & ((std::uint64_t{1} << jitter_bits) - 1)));
  }
  return stamps;
}

void expect_equal(const std::vector<std::int64_t>& stamps, const std::string& what) {
  const PackedStamps packed(stamps);
  ASSERT_EQ(packed.size(), stamps.size()) << what;
  for (std::size_t i = 0; i < stamps.size(); ++i) ASSERT_EQ(packed[i], stamps[i]) << what << ", " << i;
  const std::size_t begin = stamps.size() / 3;
  std::size_t next = begin;
  packed.for_each(begin, stamps.size(), [&](std::size_t i, std::int64_t stamp) {
    ASSERT_EQ(i, next++) << what;
    ASSERT_EQ(stamp, stamps[i]) << what << ", " << i;
  });
  EXPECT_EQ(next, stamps.size()) << what;
}

TEST(PackedStamps, AreReadAsTheyWereWritten) {
  for (const std::size_t rows : {0, 1, 4095, 4096, 4097, 20'000})
    expect_equal(stamps_with(20, rows), std::to_string(rows) + " rows");
  for (const unsigned bits : {0u, 1u, 31u, 32u, 33u, 50u, 62u})
    expect_equal(stamps_with(bits, 9000), std::to_string(bits) + " bits");
}

TEST(PackedStamps, HoldsAnyIntegers) {
  constexpr std::int64_t kLow = std::numeric_limits<std::int64_t>::min(),
                         kHigh = std::numeric_limits<std::int64_t>::max();
  std::vector<std::int64_t> stamps;
  for (std::size_t i = 0; i < 3 * 4096; ++i) stamps.push_back(i % 3 == 0 ? kLow : i % 3 == 1 ? kHigh : 0);
  expect_equal(stamps, "extremes");
  expect_equal(std::vector<std::int64_t>(5000, kHigh), "equal");
  std::mt19937_64 random(3);
  for (std::int64_t& stamp : stamps) stamp = static_cast<std::int64_t>(random());
  expect_equal(stamps, "random");
}

}  // namespace
}  // namespace prism::prismcal
