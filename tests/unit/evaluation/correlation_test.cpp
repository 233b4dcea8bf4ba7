// SPDX-License-Identifier: MIT
// Correlation and autocorrelation of series with known coefficients.
#include "compensation/evaluation/correlation.hpp"

#include <gtest/gtest.h>

#include "tests/unit/evaluation/random_series.hpp"

namespace prism::evaluation {
namespace {

TEST(Correlation, IsOneForALineAndMinusOneForItsMirror) {
  const std::vector<double> x = {1, 2, 3, 5}, y = {12, 14, 16, 20}, z = {-1, -2, -3, -5};
  EXPECT_DOUBLE_EQ(correlate(x, y, "x").value(), 1);
  EXPECT_DOUBLE_EQ(correlate(x, z, "x").value(), -1);
}

TEST(Correlation, MatchesAHandCalculation) {
  // Σdxdy = 6, Σdx² = 10, Σdy² = 10
  const std::vector<double> x = {1, 2, 3, 4, 5}, y = {2, 1, 5, 3, 4};
  EXPECT_NEAR(correlate(x, y, "x").value(), 0.6, 1e-15);
}

TEST(Correlation, WorksForVerySmallAndVeryLargeNumbers) {
  const std::vector<double> tiny = {1e-200, 2e-200, 3e-200}, huge = {1e200, 2e200, 3e200};
  EXPECT_DOUBLE_EQ(correlate(tiny, huge, "x").value(), 1);
}

TEST(Correlation, RejectsSeriesWithoutACorrelation) {
  const std::vector<double> x = {1, 2, 3}, constant = {7, 7, 7}, two = {1, 2};
  EXPECT_EQ(correlate(x, constant, "U").error().text(), "U: the series is constant: its correlation is not defined");
  EXPECT_FALSE(correlate(two, two, "U"));
  EXPECT_FALSE(correlate(x, two, "U"));
}

TEST(Autocorrelation, OfAFirstOrderProcessFallsGeometrically) {
  const std::vector<double> drive = test::white_noise(200000, 1, 5);
  std::vector<double> y(drive.size());
  for (std::size_t i = 1; i < y.size(); ++i) y[i] = 0.8 * y[i - 1] + drive[i];
  const Autocorrelation result = autocorrelate(y, 3, "x").value();
  EXPECT_DOUBLE_EQ(result.coefficient[0], 1);
  EXPECT_NEAR(result.coefficient[1], 0.8, 0.01);  // sd of r_1 is sqrt((1 − 0.64) / N) = 0.0013
  EXPECT_NEAR(result.coefficient[3], 0.512, 0.02);
}

TEST(Autocorrelation, OfWhiteNoiseStaysInItsBand) {
  const Autocorrelation result = autocorrelate(test::white_noise(10000, 1, 6), 100, "x").value();
  int outside = 0;
  for (std::size_t lag = 1; lag <= 100; ++lag) outside += std::abs(result.coefficient[lag]) > result.band;
  EXPECT_LE(outside, 12);  // 5 expected; 12 is more than three sigma above
}

TEST(Autocorrelation, LimitsLagsToTheLengthOfTheSeries) {
  EXPECT_EQ(autocorrelate(std::vector<double>{1, 2, 4}, 50, "x")->coefficient.size(), 3u);
  EXPECT_FALSE(autocorrelate(std::vector<double>{5, 5, 5}, 2, "x"));
}

}  // namespace
}  // namespace prism::evaluation
