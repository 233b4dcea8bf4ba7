// SPDX-License-Identifier: MIT
// Segments and hysteresis of a synthetic chamber cycle.
#include "compensation/evaluation/thermal.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

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

TEST(ThermalSegments, FindThePlateausAndRampsOfACycle) {
  const Cycle cycle;
  const auto segments = cut_thermal_segments(cycle.time_s, cycle.temperature_degc, {}, "x").value();
  ASSERT_EQ(segments.size(), 5u);
  const ThermalKind kinds[] = {ThermalKind::kSoak, ThermalKind::kCooling, ThermalKind::kSoak, ThermalKind::kHeating,
                               ThermalKind::kSoak};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(segments[i].kind, kinds[i]) << i;
  EXPECT_NEAR(static_cast<double>(segments[1].size()), 39, 2);
  EXPECT_NEAR(segments[2].mean_temperature_degc, -40, 0.2);
  double sum = 0;  // of the means by their lengths: that of all blocks
  for (const ThermalSegment& each : segments) sum += each.mean_temperature_degc * static_cast<double>(each.size());
  EXPECT_NEAR(sum, std::accumulate(cycle.temperature_degc.begin(), cycle.temperature_degc.end(), 0.0), 1e-9);
  EXPECT_EQ(segments.front().begin, 0u);
  EXPECT_EQ(segments.back().end, cycle.time_s.size());
  for (std::size_t i = 1; i < 5; ++i) EXPECT_EQ(segments[i].begin, segments[i - 1].end);
  Cycle interrupted;
  interrupted.temperature_degc[40] = interrupted.temperature_degc[41] = interrupted.temperature_degc[39];
  EXPECT_EQ(cut_thermal_segments(interrupted.time_s, interrupted.temperature_degc, {}, "x")->size(), 5u);
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

TEST(ThermalSegments, RejectInvalidRecords) {
  const std::vector<double> one = {1}, two = {1, 2}, back = {2, 1}, with_nan = {1, std::nan("")};
  EXPECT_FALSE(cut_thermal_segments(one, one, {}, "x"));
  EXPECT_FALSE(cut_thermal_segments(two, one, {}, "x"));
  EXPECT_FALSE(cut_thermal_segments(back, two, {}, "x"));
  EXPECT_FALSE(cut_thermal_segments(two, with_nan, {}, "x"));
}

}  // namespace
}  // namespace prism::evaluation
