// SPDX-License-Identifier: MIT
// Segments and hysteresis of a synthetic chamber cycle.
#include "compensation/evaluation/thermal.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {
namespace {

/// 20 blocks at 25 degC, down to −40 in 39, 20 there, up to 70 in 66, 20 there: 1 degC/min in blocks of 100 s.
struct Cycle {
  std::vector<double> time_s, temperature_degc;

  Cycle() {
    double t = 25;
    const auto hold = [&](int blocks) {
      for (int i = 0; i < blocks; ++i) push(t);
    };
    hold(20);
    for (int i = 0; i < 39; ++i) push(t -= 65.0 / 39);
    hold(20);
    for (int i = 0; i < 66; ++i) push(t += 110.0 / 66);
    hold(20);
  }
  void push(double t) {
    temperature_degc.push_back(t);
    time_s.push_back(100.0 * static_cast<double>(time_s.size() + 1));
  }
};

std::vector<ThermalSegment> segments_of(const Cycle& cycle) {
  return thermal_segments(thermal_kinds(cycle.time_s, cycle.temperature_degc, kSoakSlope_degc_per_s));
}

TEST(ThermalSegments, FindThePlateausAndRampsOfACycle) {
  const Cycle cycle;
  const auto segments = segments_of(cycle);
  ASSERT_EQ(segments.size(), 5u);
  const ThermalKind kinds[] = {ThermalKind::kSoak, ThermalKind::kCooling, ThermalKind::kSoak, ThermalKind::kHeating,
                               ThermalKind::kSoak};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(segments[i].kind, kinds[i]) << i;
  EXPECT_NEAR(static_cast<double>(segments[1].size()), 39, 2);
  const auto cold = std::span(cycle.temperature_degc).subspan(segments[2].begin, segments[2].size());
  EXPECT_NEAR(mean_of(cold), -40, 0.2);
  EXPECT_EQ(segments.front().begin, 0u);
  EXPECT_EQ(segments.back().end, cycle.time_s.size());
  for (std::size_t i = 1; i < 5; ++i) EXPECT_EQ(segments[i].begin, segments[i - 1].end);
  Cycle interrupted;
  interrupted.temperature_degc[40] = interrupted.temperature_degc[41] = interrupted.temperature_degc[39];
  EXPECT_EQ(segments_of(interrupted).size(), 5u);
}

TEST(Hysteresis, FindsTheSimulatedLoop) {
  const Cycle cycle;
  const auto kinds = thermal_kinds(cycle.time_s, cycle.temperature_degc, 0.1 / 60);
  std::vector<double> bias;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const double split = kinds[i] == ThermalKind::kHeating ? 0.004 : kinds[i] == ThermalKind::kCooling ? -0.002 : 9;
    bias.push_back(5e-4 * cycle.temperature_degc[i] +
                   split);  // soaks have invalid values, because they must be ignored
  }
  EXPECT_NEAR(largest_gap(cycle.temperature_degc, bias, kinds, 5).value(), 0.006, 1.3e-3);  // bin fill differs
}

TEST(Hysteresis, OfSoaksOrUnknownValuesIsNotKnown) {
  const std::vector<double> flat(5, 25.0), unknown(5, std::nan(""));
  EXPECT_FALSE(largest_gap(flat, flat, std::vector(5, ThermalKind::kSoak), 5));
  const std::vector<ThermalKind> kinds = {ThermalKind::kHeating, ThermalKind::kCooling, ThermalKind::kSoak,
                                          ThermalKind::kCooling, ThermalKind::kHeating};
  EXPECT_EQ(largest_gap(flat, flat, kinds, 5), 0);
  EXPECT_FALSE(largest_gap(unknown, flat, kinds, 5));
}

// One block a second. A slope of 0.5, from the neighbours of a block, is still a soak.
TEST(ThermalSegments, AKindIsThatOfTheSlopeBetweenTheNeighbours) {
  const auto kinds = [](const std::vector<double>& t) {
    std::vector<double> time_s;
    std::string text;
    for (std::size_t i = 0; i < t.size(); ++i) time_s.push_back(static_cast<double>(i));
    for (const ThermalKind kind : thermal_kinds(time_s, t, 0.5)) text += thermal_kind_text(kind)[0];
    return text;
  };
  EXPECT_EQ(kinds({0, 0.5, 1, 1.5}), "ssss");
  EXPECT_EQ(kinds({0, 0.51, 1, 1.5}), "hsss");
  EXPECT_EQ(kinds({0, 0, 1.01, 1}), "shss");
  EXPECT_EQ(kinds({1.5, 1, 0.5, 0}), "ssss");
  EXPECT_EQ(kinds({3, 2, 1, 1}), "ccss");
  EXPECT_EQ(kinds({7}), "s");
  EXPECT_STREQ(thermal_kind_text(ThermalKind::kSoak), "soak");
  EXPECT_STREQ(thermal_kind_text(ThermalKind::kHeating), "heating");
  EXPECT_STREQ(thermal_kind_text(ThermalKind::kCooling), "cooling");
}

// A ramp of two steps has three blocks whose neighbours differ, a single step two.
TEST(ThermalSegments, AShortOneJoinsTheOneBefore) {
  const auto segments = [](const std::vector<double>& t) {
    std::vector<double> time_s;
    std::string text;
    for (std::size_t i = 0; i < t.size(); ++i) time_s.push_back(static_cast<double>(i));
    for (const ThermalSegment& s : thermal_segments(thermal_kinds(time_s, t, 0.5)))
      text += fmt::format("{} {} to {}; ", thermal_kind_text(s.kind), s.begin, s.end);
    return text;
  };
  EXPECT_EQ(segments({0, 0, 0, 2, 4, 4, 4, 4}), "soak 0 to 2; heating 2 to 5; soak 5 to 8; ");
  EXPECT_EQ(segments({0, 0, 0, 2, 2, 2, 2}), "soak 0 to 7; ");
  EXPECT_EQ(segments({9, 7, 7, 7, 7}), "cooling 0 to 2; soak 2 to 5; ") << "none is before";
  EXPECT_EQ(segments({0, 2, 4, 6, 6, 4, 2, 0}), "heating 0 to 4; cooling 4 to 8; ");
}

// Bins of 5 degC from a multiple on: heating at 5 to 9.9 and cooling at 0 to 4.9 do not meet.
TEST(Hysteresis, IsThatOfTheMeansOfABin) {
  constexpr ThermalKind kUp = ThermalKind::kHeating, kDown = ThermalKind::kCooling;
  const std::vector<double> t = {1, 4.9, 2, 5, 9.9, 4.9, -0.1, 0};
  const std::vector<double> bias = {1, 2, 4, 10, 20, 5, 100, 6};
  EXPECT_EQ(largest_gap(t, bias, std::vector{kUp, kUp, kDown, kUp, kUp, kDown, kDown, kDown}, 5), 3.5);
  EXPECT_EQ(largest_gap(t, bias, std::vector{kUp, kUp, kUp, kUp, kDown, kUp, kDown, kUp}, 5), 10);
  EXPECT_FALSE(largest_gap(t, bias, std::vector{kUp, kUp, kUp, kUp, kUp, kUp, kDown, kUp}, 5));
}

TEST(ThermalSegments, OneBlockIsASegment) {
  EXPECT_TRUE(thermal_segments({}).empty());
  EXPECT_EQ(thermal_segments(std::vector{ThermalKind::kHeating}).size(), 1u);
}

}  // namespace
}  // namespace prism::evaluation
