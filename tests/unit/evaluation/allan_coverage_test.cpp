// SPDX-License-Identifier: MIT
// How often the intervals hold the truth, on few short series; `tools/bench allan-coverage` has 300 of every noise.
#include <gtest/gtest.h>

#include "compensation/evaluation/allan.hpp"
#include "tests/support/power_law_noise.hpp"

namespace prism::evaluation {
namespace {

// White noise of 1, quantisation of 0.3 and a walk, without and with missing values.
TEST(AllanCoverage, IntervalsAndBoundsHoldTheTruth) {
  constexpr int kSeries = 150, kValues = 2000;
  const double truth[] = {std::sqrt(0.3), 1 / 60.0, 0, std::sqrt(3e-3) * 60, 0};
  for (const bool missing : {false, true}) {
    int given[kNoiseTypes] = {}, held[kNoiseTypes] = {}, bounded[kNoiseTypes] = {}, unexplained = 0;
    for (std::uint64_t seed = 0; seed < kSeries; ++seed) {
      test::NormalPairs normal(5000 + seed);
      const auto angle = test::quantised_angle(kValues, normal), walk = test::averaged_walk(kValues, normal);
      std::vector<double> rate(kValues);
      for (std::size_t i = 0; i < kValues; ++i) {
        rate[i] = std::sqrt(0.3) * angle[i] + normal() + std::sqrt(3e-3) * walk[i];
        if (missing && (normal.uniform() < 0.01 || (i >= 900 && i < 1100))) rate[i] = std::nan("");
      }
      const AllanAnalysis found = analyse_allan(rate, 1, AllanGrid::kOctave, "x").value();
      unexplained += !found.unexplained_s.empty();
      for (std::size_t k = 0; k < kNoiseTypes; ++k) {
        const AllanCoefficient& each = (*found.coefficients)[k];
        given[k] += each.value.has_value();
        (each.value ? held : bounded)[k] += each.low <= truth[k] && truth[k] <= each.high;
      }
    }
    // Three standard deviations of 150 series around 68 %; the walk is found in most series and may be a little large.
    for (const std::size_t k : {0u, 1u, 3u}) {
      EXPECT_GE(given[k], 0.5 * kSeries) << "QNBKR"[k];
      EXPECT_NEAR(held[k] / static_cast<double>(given[k]), 0.7, 0.12) << "QNBKR"[k] << missing;
    }
    EXPECT_LE(given[2], 8) << missing;
    EXPECT_LE(given[4], 8) << missing;
    EXPECT_EQ(bounded[2], kSeries - given[2]);
    EXPECT_LE(unexplained, 1);
  }
}

}  // namespace
}  // namespace prism::evaluation
