// SPDX-License-Identifier: MIT
// Quality bits as text in both directions, and the subtraction of the bias.
#include <gtest/gtest.h>

#include <cmath>

#include "compensation/compensated.hpp"

namespace prism::compensation {
namespace {

TEST(Quality, EachBitHasItsOwnName) {
  EXPECT_EQ(quality_text(kGood), "good");
  EXPECT_EQ(quality_text(kWarming), "warming");
  EXPECT_EQ(quality_text(kNoModel), "no_model");
  EXPECT_EQ(quality_text(kInputMissing), "input_missing");
  EXPECT_EQ(quality_text(kExtrapolating), "extrapolating");
  EXPECT_EQ(quality_text(kFallback), "fallback");
  EXPECT_EQ(quality_text(kOverLimit), "over_limit");
  EXPECT_EQ(quality_text(kSettling), "settling");
  EXPECT_EQ(quality_text(kRateInvalid), "rate_invalid");
  EXPECT_EQ(quality_text(kNoData), "no_data");
  EXPECT_EQ(quality_text(kImplausible), "implausible");
  EXPECT_EQ(quality_text(kSlewLimited), "slew_limited");
  EXPECT_EQ(quality_text(kClocksDiffer), "clocks_differ");
  EXPECT_EQ(quality_text(kWarming | kFallback), "warming+fallback");
}

TEST(Quality, EverySetOfBitsReadsBack) {
  for (std::uint32_t quality = 0; quality < 4096; ++quality) EXPECT_EQ(parse_quality(quality_text(quality)), quality);
}

TEST(Quality, AllNamesTogetherFitTheBuffer) {
  EXPECT_LT(quality_text(~0u).size(), static_cast<std::size_t>(kQualityChars));
}

TEST(Quality, ReadsCompleteNamesOnly) {
  EXPECT_EQ(parse_quality("warm"), kGood);
  EXPECT_EQ(parse_quality("warming_up+settling"), kSettling);
  EXPECT_EQ(parse_quality("warming+something_newer+fallback"), kWarming | kFallback);
  EXPECT_EQ(parse_quality(""), kGood);
  EXPECT_EQ(parse_quality("+++"), kGood);
}

TEST(CorrectedRate, IsRateMinusBias) {
  EXPECT_DOUBLE_EQ(corrected_rate(8.5, {0.25, kUnknown, kGood}), 8.25);
  EXPECT_DOUBLE_EQ(corrected_rate(8.5, {-0.25, kUnknown, kGood}), 8.75);
}

TEST(CorrectedRate, IsUnknownIfEitherIsUnknown) {
  EXPECT_TRUE(std::isnan(corrected_rate(8.5, {})));
  EXPECT_TRUE(std::isnan(corrected_rate(kUnknown, {0.25, kUnknown, kGood})));
}

TEST(Correction, IsUnknownByDefault) {
  EXPECT_TRUE(std::isnan(Correction{}.bias_deg_per_h));
  EXPECT_EQ(Correction{}.quality, kNoModel);
}

}  // namespace
}  // namespace prism::compensation
