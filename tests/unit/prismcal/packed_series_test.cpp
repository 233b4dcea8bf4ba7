// SPDX-License-Identifier: MIT
// Values of a table are packed without a loss, in few bytes.
#include "tools/prismcal/recordings/packed_series.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "compensation/sample.hpp"
#include "tools/prismcal/recordings/packed_stamps.hpp"
#include "tools/prismcal/recordings/second_series.hpp"

namespace prism::recordings {
namespace {

/// Numbers of a table with `decimals` decimals.
std::vector<double> values_with(int decimals, std::size_t count) {
  std::mt19937_64 random(static_cast<std::uint64_t>(decimals));
  std::normal_distribution<> normal(0.002, 3e-4);
  std::vector<double> values;
  const double per_unit = std::pow(10.0, decimals);
  for (std::size_t i = 0; i < count; ++i) values.push_back(std::round(normal(random) * per_unit) / per_unit);
  return values;
}

void expect_equal(const std::vector<double>& values, const std::string& what) {
  constexpr double kFactor = 3600;
  PackedSeries series;
  for (const double value : values) series.push(value);
  std::vector<double> read(values.size());
  for (const double factor : {1.0, kFactor}) {
    series.scale(factor);
    series.read(0, read);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isnan(values[i]))
        ASSERT_TRUE(std::isnan(read[i])) << what << ", " << i;
      else
        ASSERT_EQ(std::bit_cast<std::uint64_t>(read[i]), std::bit_cast<std::uint64_t>(values[i] * factor))
            << what << ", " << i;
    }
  }
}

TEST(PackedSeries, IsReadAsItWasWritten) {
  for (const int decimals : {0, 6, 9, 12}) {
    std::vector<double> values = values_with(decimals, 10'000);
    expect_equal(values, std::to_string(decimals) + " decimals");
    values[1] = values[5000] = kUnknown;
    expect_equal(values, std::to_string(decimals) + " decimals and unknown values");
    values[2] = std::numeric_limits<double>::infinity();
    values[3] = -0.0;
    values[4] = 1e300;
    expect_equal(values, std::to_string(decimals) + " decimals and others");
  }
  expect_equal(std::vector<double>(5000, kUnknown), "unknown");
}

// Sanitizers have their own memory.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
/// Bytes of memory a row of what make() returns.
template <class Make>
double bytes_a_row(std::size_t rows, Make&& make) {
  const std::size_t before = mallinfo2().uordblks + mallinfo2().hblkhd;
  const auto kept = make();
  return static_cast<double>(mallinfo2().uordblks + mallinfo2().hblkhd - before) / static_cast<double>(rows);
}

TEST(PackedSeries, NeedsFewBytesAValue) {
  constexpr std::size_t kRows = 100 * 4096;
  for (const auto& [decimals, bytes] : {std::pair(6, 2.0), std::pair(9, 3.0), std::pair(15, 8.3)}) {
    const std::vector<double> values = values_with(decimals, kRows);
    EXPECT_LE(bytes_a_row(kRows,
                          [&values = values] {
                            PackedSeries series;
                            for (const double value : values) series.push(value);
                            return series;
                          }),
              bytes)
        << decimals;
  }
}

TEST(PackedStamps, NeedsFewBytesAStamp) {
  constexpr std::size_t kRows = 100 * 4096;
  std::mt19937_64 random(5);
  std::vector<std::int64_t> exact, jittered;
  std::int64_t time = 1'700'000'000'000'000'000;
  for (std::size_t i = 0; i < kRows; ++i) {
    exact.push_back(time);
    time += 10'000'000;
    jittered.push_back(time + static_cast<std::int64_t>(random() % 3'000'000));
  }
  EXPECT_LE(bytes_a_row(kRows, [&] { return PackedStamps(exact); }), 0.3);
  EXPECT_LE(bytes_a_row(kRows, [&] { return PackedStamps(jittered); }), 3.3);
}
#endif

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
  for (int form = 0; form < 4; ++form) {
    Pairs pairs;
    std::int64_t second = -5;
    for (int i = 0; i < 3 * 4096 + 100; ++i) {
      second += i % 1000 == 7 ? 60 : 1;
      const double noise = std::uniform_real_distribution<>(-1, 1)(random);
      const double logged = std::round(8e6 + 1e5 * noise) / 1e6;
      const double any = form == 0   ? logged
                         : form == 1 ? noise                                     // a capture's means
                         : form == 2 ? (i % 5000 == 2 ? -0.0 : logged)           // a block of its own form
                                     : (i < 4096 ? 8.5 : logged * 1e6 * noise);  // constant, then any size
      pairs.emplace_back(second, i % 300 == 11 ? kUnknown : any);
    }
    expect_equal(pairs);
  }
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
