// SPDX-License-Identifier: MIT
// Features: the names of model inputs, and the length of history that a definition needs.
#include "compensation/features.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace prism::compensation {
namespace {

FeatureDefinition with_two_lags() {
  FeatureDefinition definition;
  definition.lag_time_constants_s = {1500, 3900};
  return definition;
}

TEST(Features, HaveTheThreeInputsOfThePaperAndTheDefinedLags) {
  for (const std::string name : {"T", "dTdt", "U", "lag1", "lag2"})
    EXPECT_TRUE(has_input(with_two_lags(), name)) << name;
}

TEST(Features, RejectEveryOtherName) {
  const std::string names[] = {"",      "t",     "u",     "dT/dt", "lag",   "lag0", "lag3",
                               "lag-1", "lag 1", "lag1 ", "lag01", "lag1x", "Lag1", "lag99999999999999999999"};
  for (const std::string& name : names) EXPECT_FALSE(has_input(with_two_lags(), name)) << '"' << name << '"';
  EXPECT_FALSE(has_input(FeatureDefinition{}, "lag1"));
}

TEST(Features, EachNameHasItsOwnValue) {
  Window window;
  window.temperature_degc = 1;
  window.slope_degc_per_s = 2;
  window.uhfo_v = 3;
  window.lag_degc = {4, 5};
  EXPECT_EQ(input_value(window, with_two_lags(), "T"), 1);
  EXPECT_EQ(input_value(window, with_two_lags(), "dTdt"), 2);
  EXPECT_EQ(input_value(window, with_two_lags(), "U"), 3);
  EXPECT_EQ(input_value(window, with_two_lags(), "lag1"), 4);
  EXPECT_EQ(input_value(window, with_two_lags(), "lag2"), 5);
}

TEST(Features, AValueThatTheWindowDoesNotHaveIsUnknown) {
  const Window window;
  for (const std::string name : {"T", "dTdt", "U", "lag1"})
    EXPECT_TRUE(std::isnan(input_value(window, with_two_lags(), name))) << name;
}

TEST(Features, TheDifferenceAlsoNeedsItsFarEnd) {
  FeatureDefinition definition;
  definition.length_s = 100;
  definition.end_mean_s = 10;
  EXPECT_EQ(history_s(definition), 110);
  definition.slope = SlopeMethod::kLeastSquares;
  EXPECT_EQ(history_s(definition), 100);
}

TEST(Features, TheDefaultIsThePapersWindow) {
  const FeatureDefinition definition;
  EXPECT_EQ(definition.length_s, 100);
  EXPECT_EQ(definition.slope, SlopeMethod::kDifference);
}

TEST(Features, DefinitionsAreEqualOnlyIfAllPartsAreEqual) {
  const FeatureDefinition base;
  FeatureDefinition other = base;
  EXPECT_EQ(base, other);
  other.length_s = 99;
  EXPECT_NE(base, other);
  other = base, other.slope = SlopeMethod::kLeastSquares;
  EXPECT_NE(base, other);
  other = base, other.end_mean_s = 9;
  EXPECT_NE(base, other);
  other = base, other.max_gap_s = 4;
  EXPECT_NE(base, other);
  other = base, other.lag_time_constants_s = {1};
  EXPECT_NE(base, other);
}

}  // namespace
}  // namespace prism::compensation
