// SPDX-License-Identifier: MIT
// Engine: one row per sample, the bias of the last complete second, and no silently uncorrected rate.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "compensation/compensation_engine.hpp"
#include "tests/support/models.hpp"

namespace prism::compensation {
namespace {

using test::linear_model;

constexpr double kEngineRounding = 1e-12;
constexpr std::int64_t kPeriodNs = 100'000'000;  // ten samples per second

using test::kFullS;
using test::short_features;

ModelPtr temperature_model(double gain = 0.01) { return linear_model({"T"}, {gain}, 0, short_features()); }

// The engine, its clock and all its output.
struct Session {
  CompensationEngine engine;
  std::int64_t time_ns = 0;
  Sample next;
  std::vector<Compensated> rows;
  std::vector<CompensatedWindow> windows;

  explicit Session(ModelPtr model, ModelPtr fallback = nullptr, CompensationSettings s = {})
      : engine(test::believing(s)) {
    use(std::move(model), std::move(fallback));
    next.rate_deg_per_h = 8;
    next.interval_s = 0.1;
    next.temperature_degc = 25;
    next.uhfo_v = 5.25;
  }
  explicit Session(int first_seconds) : Session(temperature_model()) { seconds(first_seconds); }
  void use(ModelPtr model, ModelPtr fallback) { EXPECT_TRUE(engine.use(std::move(model), std::move(fallback))); }
  void push() {
    time_ns += kPeriodNs;
    next.time_ns = time_ns;
    Compensated out;
    if (const auto window = engine.push(next, out)) windows.push_back(*window);
    rows.push_back(out);
  }
  void seconds(int count) {
    for (int i = 0; i < 10 * count; ++i) push();
  }
  void skip(int count) { time_ns += count * kNanosecondsPerSecond; }
  const Compensated& last() const { return rows.back(); }
};

// Live and in training: a second that a session boundary cuts is published, but is part of no window.
TEST(CompensationEngine, APartialSecondIsInNoWindow) {
  Session run(temperature_model());
  run.time_ns = 3 * kPeriodNs;
  run.next.temperature_degc = 99;
  for (int i = 0; i < 7; ++i) run.push();
  run.next.temperature_degc = 25;
  run.seconds(kFullS);
  run.next.temperature_degc = 99;
  for (int i = 0; i < 5; ++i) run.push();
  const auto last = run.engine.finish();
  ASSERT_TRUE(last);
  const CompensatedWindow& first = run.windows.front();
  EXPECT_TRUE(first.window.second_mean.partial);
  EXPECT_DOUBLE_EQ(first.window.second_mean.temperature_degc, 99);
  EXPECT_TRUE(std::isnan(first.window.temperature_degc));
  EXPECT_EQ(run.windows.size(), kFullS + 1u);
  EXPECT_DOUBLE_EQ(run.windows.back().window.temperature_degc, 25);
  EXPECT_TRUE(last->window.second_mean.partial);
  EXPECT_DOUBLE_EQ(last->correction.bias_deg_per_h, 0.25) << "the bias in force during this second";
  EXPECT_TRUE(std::isnan(last->corrected_mean_deg_per_h));
}

TEST(CompensationEngine, ReturnsOneRowPerSampleAndOneWindowPerSecond) {
  Session run(20);
  EXPECT_EQ(run.rows.size(), 200u);
  ASSERT_EQ(run.windows.size(), 19u);  // the twentieth second is still open
  for (std::size_t i = 0; i < run.windows.size(); ++i)
    EXPECT_EQ(run.windows[i].window.second_mean.second, static_cast<int>(i));
  for (std::size_t i = 0; i < run.rows.size(); ++i)
    EXPECT_EQ(run.rows[i].sample.time_ns, static_cast<int>(i + 1) * kPeriodNs);
}

TEST(CompensationEngine, FindsTheSimulatedBias) {
  const ModelPtr model = linear_model({"T", "dTdt", "U"}, {0.01, -2, 0.5}, -1, short_features());
  Session run(model);
  const double slope_degc_per_s = 0.02;
  for (int i = 1; i <= 400; ++i) {
    run.next.temperature_degc = 20 + slope_degc_per_s * i * 0.1;
    run.push();
  }
  const Window& window = run.windows.back().window;
  // The mean of the 100 samples in (29, 39] s: T at 34.05 s, half a sample after the middle.
  EXPECT_NEAR(window.temperature_degc, 20 + 0.02 * 34.05, kEngineRounding);
  const double bias = -1 + 0.01 * (20 + 0.02 * 34.05) - 2 * slope_degc_per_s + 0.5 * 5.25;
  EXPECT_NEAR(run.windows.back().correction.bias_deg_per_h, bias, 1e-10);
  EXPECT_NEAR(run.windows.back().corrected_deg_per_h, 8 - bias, 1e-10);
  EXPECT_NEAR(run.windows.back().corrected_mean_deg_per_h, 8 - bias, 1e-10);
  EXPECT_EQ(run.windows.back().correction.quality, kGood);
  EXPECT_DOUBLE_EQ(run.windows.back().correction.sd_deg_per_h, 0.001);
}

TEST(CompensationEngine, ASampleIsCorrectedWithTheLastFullSecondBeforeIt) {
  Session run(temperature_model());
  run.seconds(15);
  run.next.temperature_degc = 35;
  run.seconds(1);  // seconds 0 to 14 are closed, second 15 at 35 degC is open
  EXPECT_NEAR(run.last().correction.bias_deg_per_h, 0.25, kEngineRounding);
  EXPECT_NEAR(run.last().corrected_deg_per_h, 7.75, kEngineRounding);
  run.push();  // closes second 15: its window is nine seconds of 25 and one of 35 degC
  EXPECT_NEAR(run.last().correction.bias_deg_per_h, 0.26, kEngineRounding);
}

TEST(CompensationEngine, WithoutAModelNoRateIsCorrected) {
  Session run(nullptr, temperature_model());
  run.seconds(30);
  for (const Compensated& row : run.rows) {
    EXPECT_TRUE(std::isnan(row.corrected_deg_per_h));
    EXPECT_EQ(row.correction.quality, kNoModel);
  }
  EXPECT_EQ(run.windows.back().correction.quality, kNoModel);
}

TEST(CompensationEngine, WarmingHasNoCorrectedRate) {
  Session run(temperature_model());
  run.seconds(kFullS);
  for (const Compensated& row : run.rows) {
    EXPECT_TRUE(std::isnan(row.correction.bias_deg_per_h));
    EXPECT_TRUE(std::isnan(row.corrected_deg_per_h));
    EXPECT_EQ(row.correction.quality, kWarming);
  }
  run.push();
  EXPECT_EQ(run.last().correction.quality, kGood);
  EXPECT_NEAR(run.last().corrected_deg_per_h, 7.75, kEngineRounding);
}

TEST(CompensationEngine, NoSampleAfterALongGapUsesTheOldBias) {
  Session run(20);
  ASSERT_EQ(run.last().correction.quality, kGood);
  run.skip(4);  // the limit is 3
  run.push();
  EXPECT_EQ(run.last().correction.quality, kWarming);
  EXPECT_TRUE(std::isnan(run.last().corrected_deg_per_h));
  EXPECT_EQ(run.windows.back().correction.quality, kGood);  // the second before the gap keeps its own
}

TEST(CompensationEngine, AGapWithinTheLimitKeepsTheBias) {
  Session run(20);
  run.skip(3);
  run.push();
  EXPECT_EQ(run.last().correction.quality, kGood);
  run.seconds(40);
  EXPECT_EQ(run.windows.back().correction.quality, kGood);
}

TEST(CompensationEngine, NoSampleAfterAClockSetBackUsesTheOldBias) {
  Session run(20);
  run.time_ns -= 5 * kNanosecondsPerSecond;
  run.push();
  EXPECT_EQ(run.last().correction.quality, kWarming);
  EXPECT_TRUE(std::isnan(run.last().corrected_deg_per_h));
}

TEST(CompensationEngine, FinishClosesTheOpenSecondAndClearsTheBias) {
  Session run(20);
  const auto closed = run.engine.finish();
  ASSERT_TRUE(closed);
  EXPECT_EQ(closed->window.second_mean.second, 19);
  EXPECT_EQ(closed->correction.quality, kGood);
  EXPECT_FALSE(run.engine.finish());
  run.skip(3600);
  run.push();
  EXPECT_TRUE(std::isnan(run.last().corrected_deg_per_h));
  EXPECT_EQ(run.last().correction.quality, kWarming);
}

TEST(CompensationEngine, ResetClearsTheSession) {
  Session run(20);
  run.engine.reset();
  run.push();
  EXPECT_EQ(run.last().correction.quality, kWarming);
  const std::size_t before = run.windows.size();
  run.seconds(1);
  ASSERT_EQ(run.windows.size(), before + 1);
  EXPECT_EQ(run.windows.back().window.second_mean.samples, 10u);
  EXPECT_EQ(run.windows.back().window.warm_s, 1);
}

TEST(EngineSwap, AModelWithTheSameFeaturesKeepsTheWindowAndIsInForceAtOnce) {
  Session run(temperature_model(0.01));
  run.seconds(20);
  run.push();
  run.use(temperature_model(0.02), nullptr);
  run.push();  // within the same second: no window since the swap
  EXPECT_NEAR(run.last().correction.bias_deg_per_h, 0.5, kEngineRounding);
  EXPECT_EQ(run.last().correction.quality, kGood);
  run.seconds(1);
  EXPECT_NEAR(run.windows.back().correction.bias_deg_per_h, 0.5, kEngineRounding);
}

TEST(EngineSwap, AModelWithOtherFeaturesRestartsTheWindow) {
  for (const int length_s : {9, 11}) {
    Session run(temperature_model());
    run.seconds(20);
    FeatureDefinition other = short_features();
    other.length_s = length_s;
    run.use(linear_model({"T"}, {0.02}, 0, other), nullptr);
    EXPECT_EQ(run.engine.correction().quality, kWarming);
    for (int second = 1; second < history_s(other);
         ++second) {  // the open second is complete and the first of its history
      run.seconds(1);
      EXPECT_EQ(run.rows[run.rows.size() - 10].correction.quality, kWarming) << second;
      EXPECT_EQ(run.last().correction.quality, kWarming) << second;
      EXPECT_TRUE(std::isnan(run.last().corrected_deg_per_h)) << second;
    }
    run.seconds(1);
    EXPECT_NEAR(run.last().correction.bias_deg_per_h, 0.5, kEngineRounding);
  }
}

TEST(EngineSwap, RemovingTheModelEndsTheCorrection) {
  Session run(20);
  ASSERT_TRUE(run.engine.use(nullptr, nullptr));
  EXPECT_EQ(run.engine.correction().quality, kNoModel);
  run.push();
  EXPECT_TRUE(std::isnan(run.last().corrected_deg_per_h));
}

TEST(EngineFallback, IsUsedWhileTheWindowIsNotFull) {
  Session run(temperature_model(0.01), linear_model({"T", "U"}, {0.02, 0}));
  run.seconds(kFullS);
  EXPECT_TRUE(std::isnan(run.rows[9].corrected_deg_per_h));  // the first second has no window before it
  for (std::size_t i = 10; i < run.rows.size(); ++i) {
    EXPECT_NEAR(run.rows[i].corrected_deg_per_h, 7.5, kEngineRounding);
    EXPECT_EQ(run.rows[i].correction.quality, kWarming | kFallback);
  }
  run.push();
  EXPECT_NEAR(run.last().corrected_deg_per_h, 7.75, kEngineRounding);
  EXPECT_EQ(run.last().correction.quality, kGood);
}

TEST(EngineFallback, WithoutItsInputIsFlagged) {
  Session run(temperature_model(), linear_model({"U"}, {1}));
  run.next.uhfo_v = kUnknown;
  run.seconds(3);
  EXPECT_TRUE(std::isnan(run.last().corrected_deg_per_h));
  EXPECT_EQ(run.last().correction.quality, kWarming | kFallback | kInputMissing);
}

TEST(EngineFallback, ThatNeedsASlopeIsRejectedWithoutAnyChange) {
  Session run(20);
  const ModelPtr before = run.engine.model();
  const auto refused = run.engine.use(temperature_model(0.5), linear_model({"T", "dTdt"}, {1, 1}));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().text(),
            "fallback model: needs the input dTdt, expected T and U only: it is used while the slope is unknown");
  EXPECT_EQ(run.engine.model(), before);
  EXPECT_EQ(run.engine.fallback(), nullptr);
  EXPECT_NEAR(run.engine.correction().bias_deg_per_h, 0.25, kEngineRounding);
}

TEST(EngineLimits, ABiasAboveTheLimitIsRejected) {
  for (const auto& [temperature, believed] : {std::pair{50.0, true}, {-50.0, true}, {50.1, false}, {-50.1, false}}) {
    Session run(temperature_model(0.01), nullptr, CompensationSettings{0.5});
    run.next.temperature_degc = temperature;
    run.seconds(20);
    EXPECT_EQ(run.last().correction.quality, believed ? kGood : kOverLimit) << temperature;
    EXPECT_EQ(std::isfinite(run.last().corrected_deg_per_h), believed) << temperature;
  }
}

TEST(EngineLimits, APredictionThatIsNotFiniteIsRejected) {
  // 1e308 · 1e3 · T − the same overflows to inf − inf.
  Session run(linear_model({"T", "U"}, {1e308, -1e308}, 0, short_features()));
  run.next.temperature_degc = run.next.uhfo_v = 1e3;
  run.seconds(20);
  EXPECT_EQ(run.last().correction.quality, kOverLimit);
  EXPECT_TRUE(std::isnan(run.last().correction.bias_deg_per_h));
}

TEST(EngineLimits, OutsideTheTrainingBoxIsFlagged) {
  Session run(linear_model({"T"}, {0.01}, 0, short_features(), Domain{{-40}, {24}}));
  run.seconds(20);
  EXPECT_EQ(run.last().correction.quality, kExtrapolating);
  EXPECT_NEAR(run.last().corrected_deg_per_h, 7.75, kEngineRounding);
}

TEST(EngineInputs, AModelOfTheVoltageAloneWorksWithoutAThermometer) {
  Session run(linear_model({"U"}, {0.1}, 0, short_features()));
  run.next.temperature_degc = kUnknown;
  run.seconds(20);
  EXPECT_NEAR(run.last().correction.bias_deg_per_h, 0.525, kEngineRounding);
  EXPECT_EQ(run.last().correction.quality, kGood);
}

TEST(EngineInputs, AFullWindowWithoutAnInputIsInputMissingNotWarming) {
  Session run(temperature_model());
  run.next.temperature_degc = kUnknown;
  run.seconds(20);
  EXPECT_EQ(run.last().correction.quality, kInputMissing);
  EXPECT_TRUE(std::isnan(run.last().corrected_deg_per_h));
}

TEST(EngineInputs, AFailedVoltageEndsTheCorrectionWithinTheGapLimit) {
  Session run(linear_model({"T", "U"}, {0.01, 0.1}, 0, short_features()));
  run.seconds(20);
  run.next.uhfo_v = kUnknown;
  run.seconds(4);
  EXPECT_EQ(run.last().correction.quality, kGood);  // three seconds without it are within the limit
  run.seconds(1);
  EXPECT_EQ(run.last().correction.quality, kInputMissing);
  EXPECT_TRUE(std::isnan(run.last().corrected_deg_per_h));
}

TEST(EngineInputs, SettlingLagsAreFlagged) {
  FeatureDefinition features = short_features();
  features.lag_time_constants_s = {10};
  Session run(linear_model({"T", "lag1"}, {0.01, 1}, 0, features));
  run.seconds(15);
  EXPECT_EQ(run.last().correction.quality, kSettling);
  run.seconds(20);
  EXPECT_EQ(run.last().correction.quality, kGood);
}

TEST(EngineInputs, AnInvalidRateIsFlaggedOnItsOwnSampleOnly) {
  Session run(20);
  run.next.rate_deg_per_h = kUnknown;
  run.push();
  EXPECT_EQ(run.last().correction.quality, kRateInvalid);
  EXPECT_TRUE(std::isnan(run.last().corrected_deg_per_h));
  run.next.rate_deg_per_h = 8;
  run.push();
  EXPECT_EQ(run.last().correction.quality, kGood);
  run.next.rate_deg_per_h = kUnknown;
  run.seconds(2);
  run.push();
  EXPECT_EQ(run.windows.back().correction.quality, kRateInvalid);  // a complete second without a rate
  EXPECT_TRUE(std::isnan(run.windows.back().corrected_deg_per_h));
}

// A random sequence of gaps, clock steps, failed sensors, new models and ends of sessions. A corrected rate is always
// the rate minus the bias in its row, with a quality that allows a correction.
TEST(CompensationEngine, NeverPublishesASilentlyUncorrectedRate) {
  std::mt19937_64 random(7);
  const auto chance = [&](int one_in) { return random() % static_cast<unsigned>(one_in) == 0; };
  const auto check = [](double rate, const Correction& correction, double corrected) {
    const bool biased = std::isfinite(correction.bias_deg_per_h);
    EXPECT_EQ(std::isfinite(corrected), biased && std::isfinite(rate));
    EXPECT_TRUE(!std::isfinite(corrected) || corrected == rate - correction.bias_deg_per_h);
    const bool has_reason = (correction.quality & (kWarming | kNoModel | kInputMissing | kOverLimit)) != 0;
    const bool by_fallback = (correction.quality & (kNoModel | kInputMissing | kOverLimit | kFallback)) == kFallback;
    EXPECT_TRUE(biased ? !has_reason || by_fallback : has_reason) << quality_text(correction.quality);
    EXPECT_EQ((correction.quality & kRateInvalid) != 0, !std::isfinite(rate));
  };
  const ModelPtr both = linear_model({"T", "U"}, {0.01, 0.1}, 0, short_features());
  const ModelPtr voltage = linear_model({"U"}, {0.1});
  Session run(temperature_model());
  int corrected_rows = 0;
  for (int i = 0; i < 200'000; ++i) {
    if (chance(3000)) run.skip(static_cast<int>(random() % 8) - 1);
    if (chance(4000))
      run.next.temperature_degc = chance(2) ? kUnknown : 25 + 0.001 * static_cast<double>(random() % 100);
    if (chance(4000)) run.next.uhfo_v = chance(2) ? kUnknown : 5.2;
    if (chance(2000)) run.next.rate_deg_per_h = chance(2) ? kUnknown : 8;
    if (chance(9000)) run.use(both, nullptr);
    if (chance(9000)) run.use(temperature_model(chance(4) ? 5 : 0.02), voltage);
    if (chance(30000)) run.engine.reset();
    if (chance(30000)) run.engine.finish();
    run.push();
    check(run.last().sample.rate_deg_per_h, run.last().correction, run.last().corrected_deg_per_h);
    if (std::isfinite(run.last().corrected_deg_per_h)) ++corrected_rows;
    if (testing::Test::HasFailure()) FAIL() << "at sample " << i;
  }
  for (const CompensatedWindow& row : run.windows) {
    check(row.window.second_mean.rate_deg_per_h, row.correction, row.corrected_deg_per_h);
  }
  EXPECT_GT(corrected_rows, 10'000);  // the test is valid only if many rows were corrected
}

}  // namespace
}  // namespace prism::compensation
