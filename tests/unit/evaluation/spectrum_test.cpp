// SPDX-License-Identifier: MIT
// The density of white noise, periodic parts in it, and missing values.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "compensation/evaluation/allan.hpp"
#include "tests/support/power_law_noise.hpp"

namespace prism::evaluation {
namespace {

std::vector<double> noise_and_sine(std::size_t n, double amplitude, double period_s) {
  test::NormalPairs normal(7);
  std::vector<double> rate(n);
  for (std::size_t i = 0; i < n; ++i)
    rate[i] = normal() + amplitude * std::sin(2 * std::numbers::pi * static_cast<double>(i) / period_s);
  return rate;
}

TEST(PowerSpectrum, OfWhiteNoiseIsFlat) {
  const auto spectrum = power_spectrum(noise_and_sine(40'000, 0, 1), 1, "x").value();
  EXPECT_TRUE(spectrum.lines.empty());
  double sum = 0;
  for (const double density : spectrum.density) sum += density;
  EXPECT_NEAR(sum / static_cast<double>(spectrum.density.size()), 2, 0.2);  // variance 1 in 0 to 0.5 Hz
}

TEST(PowerSpectrum, NamesAPeriodicPart) {
  std::vector<double> rate = noise_and_sine(40'000, 0.3, 30);
  for (std::size_t i = 0; i < rate.size(); i += 97) rate[i] = std::nan("");
  rate[20'000] = kAllanBreak;
  const auto spectrum = power_spectrum(rate, 1, "x").value();
  ASSERT_EQ(spectrum.lines.size(), 1u);
  EXPECT_NEAR(spectrum.lines[0].frequency_hz, 1.0 / 30, 1e-4);
  EXPECT_NEAR(spectrum.lines[0].amplitude, 0.3, 0.02);
}

TEST(PowerSpectrum, NeedsSixtyFourValues) { EXPECT_FALSE(power_spectrum(noise_and_sine(63, 0, 1), 1, "x")); }

}  // namespace
}  // namespace prism::evaluation
