// SPDX-License-Identifier: MIT
// Values of a table are packed without a loss, in few bytes.
#include "tools/prismcal/recordings/packed_series.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "compensation/sample.hpp"
#include "tools/prismcal/recordings/packed_stamps.hpp"

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

}  // namespace
}  // namespace prism::recordings
