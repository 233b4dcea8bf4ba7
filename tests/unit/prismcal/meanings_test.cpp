// SPDX-License-Identifier: MIT
// The sentence below each table and figure follows its values.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/prismcal/analysis/recording_meanings.hpp"

namespace prism::analysis {
namespace {

using evaluation::ThermalKind;
using testing::HasSubstr;

TEST(Meanings, OfBiasStability) {
  evaluation::BiasStability s;
  EXPECT_THAT(stability_meaning(s), HasSubstr("nothing to remove"));
  s.improvement = -0.1;
  EXPECT_THAT(stability_meaning(s), HasSubstr("do not use it for such recordings."));
  EXPECT_THAT(stability_meaning(s, true), HasSubstr("unless the recording is at fault"));
  s.improvement = 0.5;
  s.floor_deg_per_h = 0.006;
  s.explained = 0.97;
  s.after.sd = 0.0065;
  EXPECT_THAT(stability_meaning(s), HasSubstr("almost only white noise (0.00600 deg/h)"));
  s.after.sd = 0.018;  // most of a large drift is removed, and three times the noise is left
  EXPECT_THAT(stability_meaning(s), HasSubstr("removes 97.0 % of the drift's variance above the white noise"));
  EXPECT_THAT(stability_meaning(s), HasSubstr("The rest, 0.01800 deg/h, is 3.0 times that noise"));
}

TEST(Meanings, OfSoaksAndRamps) {
  const std::vector<ThermalKind> kinds = {ThermalKind::kSoak, ThermalKind::kSoak, ThermalKind::kHeating,
                                          ThermalKind::kCooling};
  const std::vector<double> large = {9, -9, 9, -9};
  EXPECT_THAT(segments_meaning(kinds, large, {1, -1, 1, -1}),
              HasSubstr("as good while the temperature changes as at rest"));
  EXPECT_THAT(segments_meaning(kinds, large, {1, -1, 3, -3}), HasSubstr("weaker while the temperature changes"));
  EXPECT_THAT(segments_meaning(kinds, large, {3, -3, 1, -1}), HasSubstr("weaker at constant temperature"));
  EXPECT_THAT(segments_meaning(kinds, large, {1, -1, 3, -3}, 39.4),
              HasSubstr("39 % of the recording are outside the training, so this says little"));
  EXPECT_THAT(segments_meaning(kinds, {1, -1, 1, -1}, {3, -3, 3, -3}), HasSubstr("the model makes both worse"));
  EXPECT_THAT(segments_meaning({kinds[0], kinds[1]}, {9, -9}, {1, -1}), HasSubstr("only soaks"));
}

TEST(Meanings, OfTheLoop) {
  evaluation::Hysteresis before, after;
  EXPECT_THAT(loop_meaning(before, after), HasSubstr("cannot be judged"));
  before.bins = after.bins = {{20, 0.1, 0}};
  before.max_gap_deg_per_h = 0.1, before.loop_area_deg_per_h_degc = 1;
  after.max_gap_deg_per_h = 0.02, after.loop_area_deg_per_h_degc = 0.3;
  EXPECT_THAT(loop_meaning(before, after), HasSubstr("up to 0.1 deg/h before and 0.02 deg/h after"));
  EXPECT_THAT(hysteresis_meaning(before, after, true), HasSubstr("removes 80 % of the largest difference"));
  EXPECT_THAT(hysteresis_meaning(before, after, true), HasSubstr("70 % of the area"));
  EXPECT_THAT(hysteresis_meaning(after, before, false), HasSubstr("it needs dTdt or a lag"));
  EXPECT_THAT(hysteresis_meaning(after, before, true), HasSubstr("in the training they differed in another way"));
}

TEST(Meanings, OfTheAllanDeviation) {
  EXPECT_THAT(
      allan_curve_meaning({1, 10, 100}, {3, 1, 2}, {3, 1, 0.5}),
      HasSubstr("most at averages of 100 s: 0.5 instead of 2 deg/h; in averages below 100 s the noise dominates"));
  EXPECT_THAT(allan_curve_meaning({1, 10}, {3, 1}, {3, 1}), HasSubstr("does not change"));
  EXPECT_THAT(allan_curve_meaning({1, 10}, {3, 1}, {3, 2}),
              HasSubstr("makes the rate worse, most at averages of 10 s: 2 instead of 1"));
  EXPECT_THAT(allan_curve_meaning({1, 10, 100}, {3, 1, 1}, {3, 2, 0.5}),
              HasSubstr("most at averages of 100 s: 0.5 instead of 1 deg/h; in averages below 100 s"));
  EXPECT_THAT(allan_curve_meaning({1, 10, 100}, {3, 1, 1}, {3, 2, 0.5}),
              HasSubstr("it makes it worse, most at averages of 10 s"));
  evaluation::AllanCoefficients before, after;
  before[1].value = 0.001;
  after[1].value = 0.00101;
  after[2].value = 0.002;
  EXPECT_THAT(allan_meaning(before, after), HasSubstr("adds no noise"));
  EXPECT_THAT(allan_meaning(before, after), HasSubstr("0.002 deg/h was there before, hidden by the thermal drift"));
  after[1].value = 0.0012;
  EXPECT_THAT(allan_meaning(before, after), HasSubstr("rises by 20 %"));
}

TEST(Meanings, OfTheResidual) {
  evaluation::Autocorrelation r{std::vector<double>(61, 0.01), 0.06};
  r.coefficient[0] = 1;
  EXPECT_THAT(residual_meaning(r, 100), HasSubstr("0 of 60 lags are outside the lines, as with white noise"));
  for (std::size_t i = 1; i <= 18; ++i) r.coefficient[i] = 0.4;
  EXPECT_THAT(residual_meaning(r, 100),
              HasSubstr("18 of 60 lags are outside the lines: about 40 % (variance) of the residual is a drift that "
                        "changes over about 1900 s"));
  for (std::size_t i = 1; i <= 60; ++i) r.coefficient[i] = 0.4;
  EXPECT_THAT(residual_meaning(r, 100), HasSubstr("changes over more than 1.7 h"));
}

TEST(Meanings, OfTheTrainingRange) {
  EXPECT_THAT(domain_meaning(0, 100), HasSubstr("covered all"));
  EXPECT_THAT(domain_meaning(1, 100), HasSubstr("1.0 % of this recording are outside the training: too little"));
  EXPECT_THAT(domain_meaning(20, 100), HasSubstr("record a wider cycle"));
}

}  // namespace
}  // namespace prism::analysis
