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

std::int64_t multiple_of(double resolution_s, double time_s) {
  return std::llround(1e9 * std::nearbyint(time_s / resolution_s) *
                      resolution_s);  // ties to the even number, as printf
}

/// Stamps without a loss, whose resolution is near the sample time or coarser.
struct Coarse {
  const char* name;
  double interval_s, resolution_s, start_s;
};

constexpr Coarse kCoarse[] = {{"Excel days, 5 decimals", 1, 0.864, 45352 * 86400.0},
                              {"1 s at 1.02 s", 1.02, 1, 0},
                              {"1 s at 1.05 s", 1.05, 1, 0},
                              {"1 s at 1.1 s", 1.1, 1, 0},
                              {"1 s at 1.15 s", 1.15, 1, 0},
                              {"1 s at 1.45 s", 1.45, 1, 0},
                              {"1 ms at 900 Hz", 1 / 900.0, 1e-3, 0},
                              {"10 ms at 90 Hz", 1 / 90.0, 1e-2, 0},
                              {"1 s at 0.55 s", 0.55, 1, 0},
                              {"hours, 3 decimals", 1, 3.6, 0},
                              {"1000 s at 1 s", 1, 1000, 1709294400}};

PackedStamps coarse_stamps(const Coarse& coarse, std::size_t rows) {
  PackedStamps stamps;
  for (std::size_t i = 0; i < rows; ++i)
    stamps.push(multiple_of(coarse.resolution_s, coarse.start_s + static_cast<double>(i) * coarse.interval_s));
  return stamps;
}

TEST(SampleGrid, CoarseStampsAreNoLoss) {
  for (const Coarse& coarse : kCoarse) {
    const auto grid = recordings::sample_grid(coarse_stamps(coarse, 4000), "x").value();
    EXPECT_NEAR(grid.interval_s / coarse.interval_s, 1, 5e-4) << coarse.name << ": " << grid.remark;
    EXPECT_EQ(grid.lost, 0u) << coarse.name << ": " << grid.remark;
  }
}

TEST(SampleGrid, CoarseStampsMayHavePauses) {
  for (const Coarse& coarse : kCoarse) {
    if (coarse.resolution_s > 10) continue;   // too few changes to prove it
    if (coarse.interval_s == 1.45) continue;  // the holes of the envelope are two too: 0.1 % of the sample time, 2 rows
    PackedStamps stamps;
    for (std::size_t i = 0; i < 4000; ++i) {
      const double samples = static_cast<double>(i + (i >= 1500 ? 400 : 0) + (i >= 2800 ? 5000 : 0));
      stamps.push(multiple_of(coarse.resolution_s, coarse.start_s + samples * coarse.interval_s));
    }
    const auto grid = recordings::sample_grid(stamps, "x").value();
    EXPECT_NEAR(grid.interval_s / coarse.interval_s, 1, 5e-4) << coarse.name << ": " << grid.remark;
    ASSERT_EQ(grid.holes.size(), 2u) << coarse.name << ": " << grid.remark;
    EXPECT_EQ(grid.holes[0].row, 1500u) << coarse.name;
    EXPECT_NEAR(static_cast<double>(grid.holes[0].lost), 400, 1) << coarse.name;
    EXPECT_NEAR(static_cast<double>(grid.holes[1].lost), 5000, 2) << coarse.name;
  }
}

// printf("%g") has 6 digits: the resolution grows from 0.1 s to 1 s at 100000 s.
TEST(SampleGrid, ResolutionMayGrow) {
  PackedStamps stamps;
  for (int i = 0; i < 4000; ++i) {
    const double time_s = 99000 + 0.5 * i;  // ties go to the even number
    stamps.push(std::llround(1e9 * (time_s < 100000 ? time_s : std::nearbyint(time_s))));
  }
  const auto grid = recordings::sample_grid(stamps, "x").value();
  EXPECT_NEAR(grid.interval_s, 0.5, 1e-4);
  EXPECT_EQ(grid.lost, 0u) << grid.remark;
}

/// 1 Hz; `step_s` of row i is its step from the row before.
SampleGrid grid_of_steps(std::size_t rows, const std::function<int(std::size_t i)>& step_s) {
  PackedStamps stamps;
  std::int64_t time_s = 1000;
  for (std::size_t i = 0; i < rows; ++i) stamps.push((time_s += i == 0 ? 0 : step_s(i)) * 1'000'000'000);
  return recordings::sample_grid(stamps, "x").value();
}

// A row written twice, or a leap second that is read as the second after it.
TEST(SampleGrid, RepeatedRowsDoNotChangeTheSampleTime) {
  const SampleGrid one = grid_of_steps(4000, [](std::size_t i) { return i == 2000 ? 0 : 1; });
  EXPECT_EQ(one.interval_s, 1);
  EXPECT_EQ(one.lost, 0u);
  EXPECT_EQ(one.repeated, 1u);
  EXPECT_NE(one.remark.find("1 row repeats the time of the row before"), std::string::npos) << one.remark;
  const SampleGrid with_loss = grid_of_steps(4000, [](std::size_t i) { return i == 2000 ? 0 : i == 3000 ? 3 : 1; });
  EXPECT_EQ(with_loss.interval_s, 1);
  EXPECT_EQ(with_loss.lost, 2u);
  const SampleGrid random = grid_of_steps(4000, [](std::size_t i) { return i * i % 337 == 1 ? 0 : 1; });
  EXPECT_EQ(random.interval_s, 1);
  EXPECT_EQ(random.lost, 0u);
}

TEST(SampleGrid, RepeatedRowsKeepTheirTimes) {
  std::vector<std::int64_t> stamps;
  for (int i = 0; i < 4000; ++i) stamps.push_back((i < 2000 ? i : i - 1) * std::int64_t{1'000'000'000});
  const PackedStamps packed(stamps);
  const auto times = recordings::sample_grid(packed, "x")->times_ns(packed);
  EXPECT_EQ(times[1999], stamps[1999]);
  EXPECT_EQ(times[2000], stamps[2000] + 1);  // times increase
  EXPECT_EQ(times[3999], stamps[3999]);
}

// Whole seconds at 0.995 s repeat evenly: that is the sample time, not rows written twice.
TEST(SampleGrid, EvenRepetitionIsTheSampleTime) {
  const auto grid = recordings::sample_grid(coarse_stamps({"", 0.995, 1, 0}, 4000), "x").value();
  EXPECT_NEAR(grid.interval_s, 0.995, 1e-4);
  EXPECT_EQ(grid.lost, 0u);
}

TEST(SampleGrid, LossOfExactStampsStays) {
  const SampleGrid one = grid_of_steps(4000, [](std::size_t i) { return i == 1234 ? 2 : 1; });
  EXPECT_EQ(one.interval_s, 1);
  EXPECT_EQ(one.lost, 1u);
  EXPECT_EQ(one.remark, "");
  std::mt19937 random(5);
  for (const double share : {0.003, 0.01, 0.05}) {
    std::size_t truth = 0;
    const SampleGrid grid = grid_of_steps(4000, [&](std::size_t) {
      const bool lost = std::bernoulli_distribution(share)(random);
      truth += lost;
      return lost ? 2 : 1;
    });
    EXPECT_EQ(grid.interval_s, 1) << share;
    EXPECT_EQ(grid.lost, truth) << share;
  }
  // A long hole must not hide short ones.
  const SampleGrid mixed = grid_of_steps(4000, [](std::size_t i) { return i == 3000 ? 401 : i % 397 == 5 ? 2 : 1; });
  EXPECT_EQ(mixed.interval_s, 1);
  EXPECT_EQ(mixed.lost, 411u);
}

TEST(SampleGrid, FewEvenJumpsHaveTwoReadings) {
  const auto grid = recordings::sample_grid(coarse_stamps({"", 1.02, 1, 0}, 250), "x").value();
  EXPECT_EQ(grid.interval_s, 1);
  EXPECT_EQ(grid.lost, 5u);
  EXPECT_NE(grid.remark.find("no loss and a sample time of 1.02 s is possible too"), std::string::npos) << grid.remark;
  EXPECT_NE(grid.remark.find("--interval"), std::string::npos) << grid.remark;
  const auto given = recordings::sample_grid(coarse_stamps({"", 1.02, 1, 0}, 4000), "x", 1.0).value();
  EXPECT_EQ(given.interval_s, 1);
  EXPECT_GT(given.lost, 70u);
}

TEST(SampleGrid, RefusesTimesThatGoBack) {
  const std::vector<std::int64_t> back = {1'000'000'000, 3'000'000'000, 2'000'000'000};
  EXPECT_EQ(recordings::sample_grid(PackedStamps(back), "x").error().text(),
            "x, row 3: found time 2 after 3, expected increasing times");
}

}  // namespace
}  // namespace prism::prismcal
