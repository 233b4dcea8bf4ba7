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

// By a script that sums the transform of each segment. 16 times the shortest segment are 1 024 values.
TEST(PowerSpectrum, IsThatOfWelch) {
  std::vector<double> rate;
  for (int i = 0; i < 200; ++i) rate.push_back(std::sin(i * i));
  const auto sum = [](const std::vector<double>& values) {
    double all = 0;
    for (const double value : values) all += value;
    return all;
  };
  const Spectrum brief = power_spectrum(rate, 2, "x").value();
  EXPECT_EQ(brief.segment_values, 64u);
  EXPECT_EQ(brief.segments, 5u);
  ASSERT_EQ(brief.density.size(), 27u);
  EXPECT_EQ(std::vector(brief.frequency_hz.begin(), brief.frequency_hz.begin() + 3),
            (std::vector{0.0078125, 0.015625, 0.0234375}));
  EXPECT_NEAR(brief.density[0], 2.227601281, 1e-8);
  EXPECT_NEAR(brief.density[26], 2.490540482, 1e-8);
  EXPECT_NEAR(brief.frequency_hz[26], 0.23828125, 1e-12) << "of the bins 60 to 62";
  EXPECT_NEAR(sum(brief.frequency_hz), 3.0703125, 1e-9);
  EXPECT_NEAR(sum(brief.density), 52.3920514186, 1e-8);
  EXPECT_TRUE(brief.lines.empty());

  rate.clear();
  for (int i = 0; i < 1100; ++i)
    rate.push_back(i % 40 ? std::sin(i * i) + 0.5 * std::sin(0.9 * i) + 3 * std::sin(2.1 * i) : std::nan(""));
  const Spectrum longer = power_spectrum(rate, 0.5, "x").value();
  EXPECT_EQ(longer.segment_values, 128u);
  EXPECT_EQ(longer.segments, 16u);
  ASSERT_EQ(longer.density.size(), 39u);
  EXPECT_NEAR(longer.density[0], 0.6758137826, 1e-8);
  EXPECT_NEAR(sum(longer.density), 154.689394989, 1e-7);
  EXPECT_NEAR(sum(longer.frequency_hz), 14.703125, 1e-9);
  ASSERT_EQ(longer.lines.size(), 2u);
  EXPECT_NEAR(longer.lines[0].frequency_hz, 0.6683852954715642, 1e-9) << "2.1 rad in 0.5 s";
  EXPECT_NEAR(longer.lines[0].amplitude, 2.911621760763463, 1e-8) << "of 3";
  EXPECT_NEAR(longer.lines[1].frequency_hz, 0.2858325864710965, 1e-9) << "0.9 rad in 0.5 s";
  EXPECT_NEAR(longer.lines[1].amplitude, 0.47345319409052555, 1e-8) << "of 0.5";

  for (int i = 0; i < 1100; ++i) rate[static_cast<std::size_t>(i)] = i % 90 < 5 ? std::nan("") : std::sin(i * i);
  EXPECT_EQ(power_spectrum(rate, 1, "x")->segments, 8u) << "the others lack more than a twentieth";
  EXPECT_NEAR(sum(power_spectrum(rate, 1, "x")->density), 37.5168127339, 1e-7);
}

TEST(PowerSpectrum, ASegmentIsASixteenthToAnEighthOfTheValues) {
  EXPECT_EQ(power_spectrum(noise_and_sine(1023, 0, 1), 1, "x")->segment_values, 64u);
  EXPECT_EQ(power_spectrum(noise_and_sine(1024, 0, 1), 1, "x")->segment_values, 128u);
  std::vector<double> rate = noise_and_sine(1024, 0, 1);
  for (std::size_t i = 80; i < rate.size(); i += 80) rate[i - 1] = rate[i] = rate[i + 1] = rate[i + 2] = std::nan("");
  EXPECT_EQ(power_spectrum(rate, 1, "x")->segment_values, 128u) << "4 of 128 are missing at most";
  rate = noise_and_sine(1024, 0, 1);
  for (std::size_t i = 40; i < rate.size(); i += 40) rate[i] = rate[i + 1] = rate[i + 2] = std::nan("");
  EXPECT_EQ(power_spectrum(rate, 1, "x")->segment_values, 64u) << "a segment without its share is halved";
}

TEST(PowerSpectrum, NeedsSixtyFourValues) {
  EXPECT_EQ(power_spectrum(noise_and_sine(63, 0, 1), 1, "x").error().text(),
            "x: found no 64 values in a row, expected them for a spectrum");
  EXPECT_EQ(power_spectrum(noise_and_sine(64, 0, 1), 1, "x")->segments, 1u);
}

}  // namespace
}  // namespace prism::evaluation
