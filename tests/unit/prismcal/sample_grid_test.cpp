// SPDX-License-Identifier: MIT
// The sample time of a series from damaged time stamps: the truth is constructed first.
#include "tools/prismcal/recordings/sample_grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "compensation/second_averager.hpp"

namespace prism::prismcal {
namespace {

using recordings::PackedStamps;
using recordings::SampleGrid;
using recordings::SampleHole;
using Damage = std::function<double(std::size_t k, double time_s, std::mt19937& random)>;

struct Damaged {
  const char* name;
  Damage stamp;       ///< the stamp of sample k, s
  std::size_t batch;  ///< stamps that are equal: a hole is placed within this number of rows
};

constexpr double kPhase = 0.37;  // of the samples against the clock's ticks

std::vector<Damaged> damages(double interval_s) {
  const auto rounded = [](double resolution_s) {
    return [=](std::size_t, double t, std::mt19937&) { return std::floor(t / resolution_s) * resolution_s; };
  };
  return {
      {"exact", [](std::size_t, double t, std::mt19937&) { return t; }, 1},
      {"resolution of 1 ms", rounded(1e-3), 1},
      {"resolution of 10 ms", rounded(1e-2), 5},
      {"alternating", [=](std::size_t k, double t, std::mt19937&) { return t + (k % 2 == 1 ? 0.3 * interval_s : 0); },
       1},
      {"batches of 4",
       [=](std::size_t k, double, std::mt19937&) {
         return (std::floor(static_cast<double>(k) / 4) + 1) * 4 * interval_s;
       },
       4},
      {"batches of 16",
       [=](std::size_t k, double, std::mt19937&) {
         return (std::floor(static_cast<double>(k) / 16) + 1) * 16 * interval_s;
       },
       16},
      {"jitter",
       [=](std::size_t, double t, std::mt19937& r) {
         return t + std::uniform_real_distribution<>(0, 0.4 * interval_s)(r);
       },
       1},
      {"normal jitter",
       [=](std::size_t, double t, std::mt19937& r) { return t + std::normal_distribution<>(0, 0.08 * interval_s)(r); },
       1}};
}

PackedStamps stamps_of(const Damaged& damaged, double interval_s, std::size_t rows,
                       const std::vector<SampleHole>& holes) {
  std::mt19937 random(7);
  std::vector<std::int64_t> stamps;
  std::size_t k = 0, hole = 0;
  for (std::size_t row = 0; row < rows; ++row, ++k) {
    if (hole < holes.size() && holes[hole].row == row) k += holes[hole++].lost;
    stamps.push_back(std::llround(1e9 * damaged.stamp(k, (static_cast<double>(k) + kPhase) * interval_s, random)));
    if (row > 0) stamps[row] = std::max(stamps[row], stamps[row - 1]);
  }
  return PackedStamps(stamps);
}

TEST(SampleGrid, FindsTheSampleTimeUnderEachDamage) {
  for (const double interval_s : {2.5e-3, 5e-3, 10e-3}) {
    for (const Damaged& damaged : damages(interval_s)) {
      const std::string what = std::string(damaged.name) + ", " + std::to_string(interval_s);
      const auto grid = recordings::sample_grid(stamps_of(damaged, interval_s, 20000, {}), "x");
      ASSERT_TRUE(grid) << what << grid.error().text();
      EXPECT_NEAR(grid->interval_s / interval_s, 1, 0.002) << what;  // N goes with its root: within 0.1 %
      EXPECT_EQ(grid->lost, 0u) << what << ": the first hole at row " << (grid->holes.empty() ? 0 : grid->holes[0].row);
    }
  }
}

TEST(SampleGrid, FindsEachHoleAndItsLength) {
  const std::vector<SampleHole> truth = {{1000, 1}, {1600, 3}, {5008, 16}, {5200, 1}, {9008, 400}, {15008, 4}};
  for (const double interval_s : {2.5e-3, 5e-3, 10e-3}) {
    for (const Damaged& damaged : damages(interval_s)) {
      const std::string what = std::string(damaged.name) + ", " + std::to_string(interval_s);
      const auto grid = recordings::sample_grid(stamps_of(damaged, interval_s, 20000, truth), "x");
      ASSERT_TRUE(grid) << what << grid.error().text();
      EXPECT_NEAR(grid->interval_s / interval_s, 1, 0.002) << what;
      ASSERT_EQ(grid->holes.size(), truth.size()) << what;
      for (std::size_t i = 0; i < truth.size(); ++i) {
        EXPECT_EQ(grid->holes[i].lost, truth[i].lost) << what << ", hole " << i;
        EXPECT_NEAR(static_cast<double>(grid->holes[i].row), static_cast<double>(truth[i].row),
                    static_cast<double>(damaged.batch - 1))
            << what << ", hole " << i;
      }
    }
  }
}

TEST(SampleGrid, SaysWhyTheMedianStepIsNotUsed) {
  const auto batches = recordings::sample_grid(stamps_of(damages(0.01)[4], 0.01, 4000, {}), "x").value();
  EXPECT_NE(batches.remark.find("median step 0 s"), std::string::npos) << batches.remark;
  EXPECT_NE(batches.remark.find("stamps repeat"), std::string::npos) << batches.remark;
  EXPECT_TRUE(recordings::sample_grid(stamps_of(damages(0.01)[0], 0.01, 4000, {}), "x")->remark.empty());
}

TEST(SampleGrid, PlacesDamagedStampsOnTheGrid) {
  const auto stamps = stamps_of(damages(0.01)[5], 0.01, 4000, {{2000, 5}});
  const auto grid = recordings::sample_grid(stamps, "x").value();
  const auto times = grid.times_ns(stamps);
  EXPECT_NEAR(static_cast<double>(times[100] - times[99]), 1e7, 1e4);
  EXPECT_NEAR(static_cast<double>(times[2000] - times[1999]), 6e7, 1e6);
}

// Excel days have a resolution of microseconds. Before, the samples at the ends of seconds fell on either side: of a
// recording of 92 400 s without a loss, 23 955 s had no sample and as many had two.
TEST(SampleGrid, SecondsOfRoundedDaysHaveOneSampleEach) {
  std::vector<std::int64_t> rounded;
  for (std::int64_t second = 1; second <= 20000; ++second) {
    const double days = 46023 + static_cast<double>(second) / 86400;
    rounded.push_back(std::llround(std::round(days * 1e10) / 1e10 * 86400e9));
  }
  const PackedStamps stamps(rounded);
  const auto grid = recordings::sample_grid(stamps, "x").value();
  EXPECT_EQ(grid.lost, 0u);
  const auto times = grid.times_ns(stamps);
  int uneven = 0;
  for (std::size_t i = 1; i < times.size(); ++i)
    uneven += compensation::second_number(times[i]) != compensation::second_number(times[i - 1]) + 1;
  EXPECT_LE(uneven, 2);  // the mean lateness is not exactly 0
}

TEST(SampleGrid, RefusesTimesThatGoBack) {
  const std::vector<std::int64_t> back = {1'000'000'000, 3'000'000'000, 2'000'000'000};
  EXPECT_EQ(recordings::sample_grid(PackedStamps(back), "x").error().text(),
            "x, row 3: found time 2 after 3, expected increasing times");
}

}  // namespace
}  // namespace prism::prismcal
