// SPDX-License-Identifier: MIT
// SecondAverager: the samples of one second become their weighted means.
#include "compensation/second_averager.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <vector>

namespace prism::compensation {
namespace {

constexpr double kMeanTolerance = 1e-9;  // sums of some hundred doubles near 10

Sample sample_at(std::int64_t time_ns, double rate_deg_per_h = 1, double interval_s = 0.1) {
  Sample sample;
  sample.time_ns = time_ns;
  sample.rate_deg_per_h = rate_deg_per_h;
  sample.interval_s = interval_s;
  return sample;
}

SecondMean only_mean(const std::vector<Sample>& samples) {
  SecondAverager averager;
  for (const Sample& sample : samples) EXPECT_FALSE(averager.push(sample));
  return averager.finish().value_or(SecondMean{});
}

struct SecondAveragerTest : testing::Test {
  SecondAverager averager;
};

TEST_F(SecondAveragerTest, WeightsTheRateByTheSampleInterval) {
  const SecondMean second_mean = only_mean({sample_at(250'000'000, 1, 0.25), sample_at(1'000'000'000, 3, 0.75)});
  EXPECT_DOUBLE_EQ(second_mean.rate_deg_per_h, 2.5);  // (1 · 0.25 + 3 · 0.75) / 1
  EXPECT_EQ(second_mean.samples, 2u);
}

TEST_F(SecondAveragerTest, ASampleBelongsToTheSecondInWhichItsIntervalEnds) {
  const std::pair<std::int64_t, std::int64_t> rows[] = {{1, 0},
                                                        {999'999'999, 0},
                                                        {1'000'000'000, 0},
                                                        {1'000'000'001, 1},
                                                        {0, -1},
                                                        {-1, -1},
                                                        {-999'999'999, -1},
                                                        {-1'000'000'000, -2},
                                                        {-1'000'000'001, -2},
                                                        {1'795'425'060'000'000'000, 1'795'425'059}};
  for (const auto& [time_ns, second] : rows) {
    EXPECT_EQ(only_mean({sample_at(time_ns)}).second, second) << time_ns;
    EXPECT_EQ(second_number(time_ns), second) << time_ns;
  }
}

TEST_F(SecondAveragerTest, AQuantityWithoutValuesInTheSecondIsUnknown) {
  const SecondMean second_mean = only_mean({sample_at(1, kUnknown), sample_at(2, kUnknown)});
  EXPECT_TRUE(std::isnan(second_mean.rate_deg_per_h));
  EXPECT_TRUE(std::isnan(second_mean.temperature_degc));
  EXPECT_TRUE(std::isnan(second_mean.uhfo_v));
  EXPECT_EQ(second_mean.samples, 2u);
}

TEST_F(SecondAveragerTest, AnUnknownQuantityOfOneSampleDoesNotChangeTheMeanOfTheOthers) {
  Sample first = sample_at(1, 4), second = sample_at(2, kUnknown, 100);
  first.uhfo_v = 5.25;
  second.temperature_degc = 25;
  const SecondMean second_mean = only_mean({first, second});
  EXPECT_DOUBLE_EQ(second_mean.rate_deg_per_h, 4);
  EXPECT_DOUBLE_EQ(second_mean.temperature_degc, 25);
  EXPECT_DOUBLE_EQ(second_mean.uhfo_v, 5.25);
}

// One valid frame of 400 had given the rate of a whole second.
TEST_F(SecondAveragerTest, AFewValidRatesDoNotStandForASecond) {
  std::vector<Sample> samples;
  for (int i = 1; i <= 10; ++i) samples.push_back(sample_at(i, i <= 5 ? 3 : kUnknown));
  EXPECT_DOUBLE_EQ(only_mean(samples).rate_deg_per_h, 3);
  samples.push_back(sample_at(11, kUnknown));
  EXPECT_TRUE(std::isnan(only_mean(samples).rate_deg_per_h));
}

TEST_F(SecondAveragerTest, AnInfiniteValueIsIgnored) {
  Sample broken = sample_at(1, HUGE_VAL);
  broken.temperature_degc = -HUGE_VAL;
  const SecondMean second_mean = only_mean({broken, sample_at(2, 7)});
  EXPECT_DOUBLE_EQ(second_mean.rate_deg_per_h, 7);
  EXPECT_TRUE(std::isnan(second_mean.temperature_degc));
}

TEST_F(SecondAveragerTest, CombinesStatusBitsAndAddsMissingFrames) {
  Sample first = sample_at(1), second = sample_at(2);
  first.status = 0x01, second.status = 0x80;
  first.missing_frames = 3, second.missing_frames = 4;
  const SecondMean second_mean = only_mean({first, second});
  EXPECT_EQ(second_mean.status, 0x81u);
  EXPECT_EQ(second_mean.missing_frames, 7u);
}

TEST_F(SecondAveragerTest, SecondsWithoutSamplesReturnNoMean) {
  EXPECT_FALSE(averager.push(sample_at(500'000'000, 1)));
  const auto first = averager.push(sample_at(7'500'000'000, 2));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->second, 0);
  const auto second = averager.finish();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->second, 7);
  EXPECT_DOUBLE_EQ(second->rate_deg_per_h, 2);  // contains nothing of the first second
  EXPECT_EQ(second->samples, 1u);
}

TEST_F(SecondAveragerTest, FinishReturnsTheOpenSecondOnce) {
  EXPECT_FALSE(averager.finish());
  averager.push(sample_at(1));
  EXPECT_TRUE(averager.finish());
  EXPECT_FALSE(averager.finish());
  EXPECT_FALSE(averager.push(sample_at(2)));  // the next sample opens a new second
  EXPECT_TRUE(averager.finish());
}

TEST_F(SecondAveragerTest, AClockSetBackClosesTheSecond) {
  averager.push(sample_at(9'500'000'000, 1));
  const auto closed = averager.push(sample_at(3'500'000'000, 2));
  ASSERT_TRUE(closed);
  EXPECT_EQ(closed->second, 9);
  EXPECT_EQ(averager.finish().value().second, 3);
}

// Ten samples a second at the tenths after `phase_ns`, from sample `first` to sample `last`.
std::vector<bool> partial_seconds(int first, int last, std::int64_t phase_ns) {
  SecondAverager averager;
  std::vector<bool> partial;
  for (int i = first; i <= last; ++i) {
    if (const auto second_mean = averager.push(sample_at(100'000'000LL * i + phase_ns)))
      partial.push_back(second_mean->partial);
  }
  if (const auto second_mean = averager.finish()) partial.push_back(second_mean->partial);
  return partial;
}

TEST_F(SecondAveragerTest, ASecondCutByTheSessionIsPartial) {
  using Seconds = std::vector<bool>;
  EXPECT_EQ(partial_seconds(1, 30, 0), Seconds({false, false, false}));
  EXPECT_EQ(partial_seconds(2, 30, 0), Seconds({true, false, false}));
  EXPECT_EQ(partial_seconds(1, 29, 0), Seconds({false, false, true}));
  EXPECT_EQ(partial_seconds(7, 23, 0), Seconds({true, false, true}));
  EXPECT_EQ(partial_seconds(4, 6, 0), Seconds({true}));
  EXPECT_EQ(partial_seconds(0, 29, 30'000'000), Seconds({false, false, false})) << "its interval began before";
  EXPECT_EQ(partial_seconds(1, 29, 30'000'000), Seconds({true, false, false}));
  EXPECT_EQ(partial_seconds(0, 28, 30'000'000), Seconds({false, false, true}));
}

TEST_F(SecondAveragerTest, LostFramesWithinASessionMakeNoSecondPartial) {
  averager.push(sample_at(100'000'000));
  EXPECT_FALSE(averager.push(sample_at(5'500'000'000))->partial);
  EXPECT_FALSE(averager.push(sample_at(6'000'000'001))->partial);
}

TEST_F(SecondAveragerTest, SamplesAfterTheEndStartANewSession) {
  for (int i = 1; i <= 10; ++i) averager.push(sample_at(i * 100'000'000));
  EXPECT_FALSE(averager.finish()->partial);
  for (int i = 15; i <= 20; ++i) averager.push(sample_at(i * 100'000'000));
  EXPECT_TRUE(averager.finish()->partial);
}

// A simple reference: keeps all samples of a second, then averages them.
TEST_F(SecondAveragerTest, EqualsAReferenceThatKeepsAllSamples) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::map<std::int64_t, std::vector<Sample>> kept;
  std::vector<SecondMean> second_means;
  for (std::int64_t time_ns = 0; time_ns < 200 * kNanosecondsPerSecond;) {
    time_ns += 1 + static_cast<std::int64_t>(unit(random) * (unit(random) < 0.02 ? 3e9 : 2e7));
    Sample sample = sample_at(time_ns, unit(random) < 0.1 ? kUnknown : 10 * unit(random), 0.001 + unit(random));
    if (unit(random) < 0.5) sample.temperature_degc = 70 * unit(random);
    kept[(time_ns + kNanosecondsPerSecond - 1) / kNanosecondsPerSecond - 1].push_back(sample);
    if (const auto second_mean = averager.push(sample)) second_means.push_back(*second_mean);
  }
  if (const auto second_mean = averager.finish()) second_means.push_back(*second_mean);
  ASSERT_EQ(second_means.size(), kept.size());
  for (const SecondMean& second_mean : second_means) {
    double angle = 0, time = 0, rates = 0, temperature = 0, temperatures = 0;
    for (const Sample& sample : kept.at(second_mean.second)) {
      if (std::isfinite(sample.rate_deg_per_h))
        angle += sample.rate_deg_per_h * sample.interval_s, time += sample.interval_s, ++rates;
      if (std::isfinite(sample.temperature_degc)) temperature += sample.temperature_degc, ++temperatures;
    }
    EXPECT_EQ(second_mean.samples, kept.at(second_mean.second).size());
    const bool has_rate = 2 * rates >= static_cast<double>(second_mean.samples);
    ASSERT_EQ(std::isfinite(second_mean.rate_deg_per_h), has_rate);
    if (has_rate) {
      EXPECT_NEAR(second_mean.rate_deg_per_h, angle / time, kMeanTolerance);
    }
    ASSERT_EQ(std::isfinite(second_mean.temperature_degc), temperatures > 0);
    if (temperatures > 0) {
      EXPECT_NEAR(second_mean.temperature_degc, temperature / temperatures, kMeanTolerance);
    }
  }
}

}  // namespace
}  // namespace prism::compensation
