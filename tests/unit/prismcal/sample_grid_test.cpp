// SPDX-License-Identifier: MIT
// The sample time of a series from its time stamps: the truth is constructed first.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "tools/prismcal/series.hpp"

namespace prism::recordings {
namespace {

using testing::HasSubstr;
using Stamps = std::vector<std::int64_t>;
using Stamp = std::function<double(std::size_t k, double time_s, std::mt19937& random)>;

struct Form {
  const char* name;
  Stamp stamp;  ///< of sample k, s
};

Stamp rounded(double resolution_s) {
  return [=](std::size_t, double t, std::mt19937&) { return std::floor(t / resolution_s) * resolution_s; };
}

/// Each stamp is within half an interval of the grid.
std::vector<Form> regular(double interval_s) {
  return {
      {"exact", [](std::size_t, double t, std::mt19937&) { return t; }},
      {"1 ms", rounded(1e-3)},
      {"alternating", [=](std::size_t k, double t, std::mt19937&) { return t + (k % 2 == 1 ? 0.3 * interval_s : 0); }},
      {"jitter", [=](std::size_t, double t,
                     std::mt19937& r) { return t + std::uniform_real_distribution<>(0, 0.4 * interval_s)(r); }},
      {"normal jitter", [=](std::size_t, double t, std::mt19937& r) {
         return t + std::normal_distribution<>(0, 0.06 * interval_s)(r);
       }}};
}

Stamps stamps_of(const Stamp& stamp, double interval_s, std::size_t rows, const std::vector<SampleHole>& holes = {}) {
  constexpr double kPhase = 0.37;  // of the samples against the clock's ticks
  std::mt19937 random(7);
  Stamps stamps;
  std::size_t k = 0, hole = 0;
  for (std::size_t row = 0; row < rows; ++row, ++k) {
    if (hole < holes.size() && holes[hole].row == row) k += holes[hole++].lost;
    stamps.push_back(std::llround(1e9 * stamp(k, (static_cast<double>(k) + kPhase) * interval_s, random)));
  }
  return stamps;
}

std::string refusal_of(const Stamps& stamps) {
  const auto grid = sample_grid(stamps, "x");
  return grid ? fmt::format("every {} s, {} lost", grid->interval_s, grid->lost) : grid.error().text();
}

TEST(SampleGrid, FindsTheSampleTimeAndEachHole) {
  const std::vector<SampleHole> truth = {{1000, 1}, {1600, 3}, {5008, 16}, {5200, 1}, {9008, 400}, {15008, 4}};
  for (const double interval_s : {5e-3, 1 / 128.0, 10e-3, 1.0}) {
    for (const Form& form : regular(interval_s)) {
      for (const auto& holes : {std::vector<SampleHole>(), truth}) {
        const std::string what = fmt::format("{}, {} s, {} holes", form.name, interval_s, holes.size());
        const auto grid = sample_grid(stamps_of(form.stamp, interval_s, 20000, holes), "x");
        ASSERT_TRUE(grid) << what << grid.error().text();
        EXPECT_NEAR(grid->interval_s / interval_s, 1, 0.001) << what;  // N goes with its root: within 0.05 %
        ASSERT_EQ(grid->holes.size(), holes.size()) << what;
        for (std::size_t i = 0; i < holes.size(); ++i) {
          EXPECT_EQ(grid->holes[i].lost, holes[i].lost) << what << ", hole " << i;
          EXPECT_EQ(grid->holes[i].row, holes[i].row) << what << ", hole " << i;
        }
      }
    }
  }
}

TEST(SampleGrid, NeedsTwoTimes) {
  EXPECT_EQ(refusal_of({}), "x: found 0 times, expected 2 or more");
  EXPECT_EQ(refusal_of({7}), "x: found 1 time, expected 2 or more");
  EXPECT_EQ(refusal_of({7, 7, 7}), "x: found the same time in all rows");
  EXPECT_EQ(refusal_of({7, 2'000'000'007}), "every 2 s, 0 lost");
}

TEST(SampleGrid, LossAtRandomStays) {
  std::mt19937 random(5);
  for (const double share : {0.003, 0.01, 0.05, 0.2}) {
    Stamps stamps;
    std::size_t lost = 0;
    for (std::int64_t second = 0; second < 4000; ++second) {
      if (second > 0 && second < 3999 && std::bernoulli_distribution(share)(random))
        ++lost;
      else
        stamps.push_back(second * 1'000'000'000);
    }
    const auto grid = sample_grid(stamps, "x").value();
    EXPECT_EQ(grid.interval_s, 1) << share;
    EXPECT_EQ(grid.lost, lost) << share;
    EXPECT_EQ(grid.notes.size(), 1u) << share;
  }
}

TEST(SampleGrid, FollowsADrift) {
  Stamps stamps;
  for (int i = 0; i < 40000; ++i) stamps.push_back(std::llround(1e9 * i * (1 + 1e-7 * i)));
  const auto grid = sample_grid(stamps, "x").value();
  EXPECT_EQ(grid.lost, 0u);
  EXPECT_NEAR(grid.interval_s, 1.004, 1e-4);
}

TEST(SampleGrid, AsksForTheStepOfOtherStamps) {
  const auto batches = [](std::size_t size) {
    return [=](std::size_t k, double, std::mt19937&) { return static_cast<double>(k - k % size) * 0.01; };
  };
  for (const std::size_t size : {2, 4, 16, 100})
    EXPECT_THAT(refusal_of(stamps_of(batches(size), 0.01, 4000)),
                HasSubstr("state the true step with --interval SECONDS"))
        << size;
  const Stamp jitter = [](std::size_t, double t, std::mt19937& r) {
    return t + std::uniform_real_distribution<>(0, 0.99)(r);
  };
  EXPECT_THAT(refusal_of(stamps_of(jitter, 1, 4000)), HasSubstr("--interval SECONDS"));
  EXPECT_THAT(refusal_of(stamps_of(rounded(1), 0.995, 4000)), HasSubstr("--interval SECONDS"));
  EXPECT_THAT(refusal_of(stamps_of(rounded(1), 0.55, 4000)), HasSubstr("--interval SECONDS"));
}

// Rounding makes jumps at even distances, and so may a loss.
TEST(SampleGrid, NamesBothReadingsOfEvenJumps) {
  EXPECT_EQ(refusal_of(stamps_of(rounded(1), 1.02, 4000)),
            "x: two readings are possible: a row every 1 s, and 80 holes at even distances, or every 1.02 s with "
            "rounded times; state --interval");
  for (const double interval_s : {1.05, 1.1, 1.15})
    EXPECT_THAT(refusal_of(stamps_of(rounded(1), interval_s, 4000)), HasSubstr("two readings")) << interval_s;
  EXPECT_THAT(refusal_of(stamps_of(rounded(1e-3), 1 / 900.0, 4000)), HasSubstr("two readings"));
  EXPECT_THAT(refusal_of(stamps_of(rounded(0.864), 1, 4000)), HasSubstr("two readings"));
  for (const double interval_s : {1.45, 1.55, 1.7}) {
    const auto grid = sample_grid(stamps_of(rounded(1), interval_s, 4000), "x");
    EXPECT_TRUE(!grid || std::fabs(grid->interval_s / interval_s - 1) < 1e-3) << interval_s;
  }
}

TEST(SampleGrid, AStatedStepDecides) {
  const auto even = sample_grid(stamps_of(rounded(1), 1.02, 4000), "x", 1.0).value();
  EXPECT_EQ(even.lost, 80u);
  const Stamp batches = [](std::size_t k, double, std::mt19937&) { return static_cast<double>(k - k % 10); };
  const auto grid = sample_grid(stamps_of(batches, 1, 4000, {{2000, 50}}), "x", 1.0).value();
  EXPECT_EQ(grid.interval_s, 1);
  EXPECT_EQ(grid.lost, 50u);
  StatedTimes times(1);
  std::int64_t before = 0;
  for (const std::int64_t stamp : stamps_of(batches, 1, 4000, {{2000, 50}})) {
    const std::int64_t time = times.push(stamp);
    const std::int64_t steps = times.lost() > 0 ? 51 : 1;
    if (before > 0) {
      EXPECT_EQ(time - before, steps * 1'000'000'000);
    }
    before = time;
  }
}

TEST(SampleGrid, FewTimes) {
  EXPECT_EQ(refusal_of({1}), "x: found 1 time, expected 2 or more");
  EXPECT_EQ(refusal_of({1, 1, 1}), "x: found the same time in all rows");
  EXPECT_EQ(refusal_of({0, 500'000'000}), "every 0.5 s, 0 lost");
  EXPECT_EQ(refusal_of({0, 1'000'000'000, 2'000'000'000, 4'000'000'000, 5'000'000'000}), "every 1 s, 1 lost");
  EXPECT_EQ(refusal_of({0, 2'000'000'000, 3'000'000'000, 4'000'000'000, 5'000'000'000}), "every 1 s, 1 lost");
}

// One time that is late by this share of the step.
TEST(SampleGrid, NamesJitterOfMoreThanAHundredthOfTheStep) {
  const auto notes_of = [](double late) {
    return sample_grid({0, std::llround(1e9 * (1 + late)), 2'000'000'000, 3'000'000'000}, "x")->notes;
  };
  EXPECT_THAT(notes_of(0.005), testing::IsEmpty());
  EXPECT_THAT(notes_of(0.015),
              testing::ElementsAre("time: mean step 1 s, median step 1 s; used: 1 s, count over span"));
}

}  // namespace
}  // namespace prism::recordings
