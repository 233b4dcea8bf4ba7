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

TEST(SecondAverager, ASampleBelongsToTheSecondInWhichItsIntervalEnds) {
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
    SecondAverager averager;
    EXPECT_FALSE(averager.push(sample_at(time_ns)));
    EXPECT_EQ(averager.finish().value().second, second) << time_ns;
    EXPECT_EQ(second_number(time_ns), second) << time_ns;
  }
}

TEST(SecondAverager, FinishReturnsTheOpenSecondOnceAndAClockSetBackClosesIt) {
  SecondAverager averager;
  EXPECT_FALSE(averager.finish());
  averager.push(sample_at(9'500'000'000));
  EXPECT_EQ(averager.push(sample_at(3'500'000'000)).value().second, 9);
  EXPECT_EQ(averager.finish().value().second, 3);
  EXPECT_FALSE(averager.finish());
  EXPECT_FALSE(averager.push(sample_at(2)));  // the next sample opens a new second
  EXPECT_TRUE(averager.finish());
}

// Ten samples a second at the tenths after `phase_ns`, from sample `first` to sample `last`, without those from 11 on
// of `lost`. "P": a partial second.
std::string partial_seconds(int first, int last, std::int64_t phase_ns, int lost = 0) {
  SecondAverager averager;
  std::string partial;
  for (int i = first; i <= last; ++i) {
    if (i > 10 && i <= 10 + lost) continue;
    if (const auto second_mean = averager.push(sample_at(100'000'000LL * i + phase_ns)))
      partial += second_mean->partial ? 'P' : '-';
  }
  if (const auto second_mean = averager.finish()) partial += second_mean->partial ? 'P' : '-';
  return partial;
}

TEST(SecondAverager, ASecondCutByTheSessionIsPartial) {
  EXPECT_EQ(partial_seconds(1, 30, 0), "---");
  EXPECT_EQ(partial_seconds(2, 30, 0), "P--");
  EXPECT_EQ(partial_seconds(1, 29, 0), "--P");
  EXPECT_EQ(partial_seconds(7, 23, 0), "P-P");
  EXPECT_EQ(partial_seconds(4, 6, 0), "P");
  EXPECT_EQ(partial_seconds(0, 29, 30'000'000), "---") << "its interval began before";
  EXPECT_EQ(partial_seconds(1, 29, 30'000'000), "P--");
  EXPECT_EQ(partial_seconds(0, 28, 30'000'000), "--P");
  EXPECT_EQ(partial_seconds(1, 60, 0, 44), "--") << "lost frames within a session make no second partial";
}

struct ReferenceMean {
  double sum = 0, weight = 0, wrong_sum = 0, wrong_weight = 0;
  std::size_t known = 0;
  bool any_implausible = false;

  void add(double value, double by, bool implausible) {
    any_implausible = any_implausible || implausible;
    if (std::isnan(value)) return;
    ++known;
    (implausible ? wrong_sum : sum) += by * value;
    (implausible ? wrong_weight : weight) += by;
  }
  void expect(double found, bool any, bool all, bool counts) const {
    EXPECT_EQ(any, any_implausible);
    EXPECT_EQ(all, any_implausible && weight == 0);
    const double expected = weight > 0 ? sum / weight : wrong_sum / wrong_weight;
    ASSERT_EQ(std::isfinite(found), std::isfinite(expected) && counts);
    if (std::isfinite(found)) {
      EXPECT_NEAR(found, expected, kMeanTolerance);
    }
  }
};

// A simple reference: keeps all samples of a second, then averages them: the rate by its interval, if half of the
// samples or more have one. Values that are unknown or implausible are left out, unless all are implausible.
TEST(SecondAverager, EqualsAReferenceThatKeepsAllSamples) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::map<std::int64_t, std::vector<std::pair<Sample, QuantitySet>>> kept;
  std::vector<SecondMean> second_means;
  SecondAverager averager;
  for (std::int64_t time_ns = 0; time_ns < 400 * kNanosecondsPerSecond;) {
    time_ns += 1 + static_cast<std::int64_t>(unit(random) * (unit(random) < 0.02 ? 3e9 : 2e7));
    const std::int64_t second = (time_ns + kNanosecondsPerSecond - 1) / kNanosecondsPerSecond - 1;
    const double often = second % 3 == 0 ? 0.5 : 0.1;
    Sample sample = sample_at(time_ns, unit(random) < often ? kUnknown : 10 * unit(random), 0.001 + unit(random));
    if (unit(random) < 0.5) sample.temperature_degc = 70 * unit(random);
    if (unit(random) < 0.5) sample.uhfo_v = 5 * unit(random);
    if (unit(random) < 0.05) sample.status = 1u << (random() % 32);
    sample.missing_frames = static_cast<std::uint32_t>(random() % 3);
    const auto wrong = [&] { return second % 10 == 0 || (second % 5 == 0 && unit(random) < 0.3); };
    const QuantitySet implausible{wrong(), wrong(), wrong()};
    kept[second].emplace_back(sample, implausible);
    if (const auto second_mean = averager.push(sample, implausible)) second_means.push_back(*second_mean);
  }
  if (const auto second_mean = averager.finish()) second_means.push_back(*second_mean);
  ASSERT_EQ(second_means.size(), kept.size());
  for (const SecondMean& mean : second_means) {
    ReferenceMean rate, temperature, uhfo;
    std::uint32_t status = 0, missing = 0;
    for (const auto& [sample, implausible] : kept.at(mean.second)) {
      rate.add(sample.rate_deg_per_h, sample.interval_s, implausible.rate);
      temperature.add(sample.temperature_degc, 1, implausible.temperature);
      uhfo.add(sample.uhfo_v, 1, implausible.uhfo);
      status |= sample.status;
      missing += sample.missing_frames;
    }
    EXPECT_EQ(mean.samples, kept.at(mean.second).size());
    EXPECT_EQ(mean.status, status);
    EXPECT_EQ(mean.missing_frames, missing);
    const QuantitySet any = mean.implausible, all = mean.all_implausible;
    rate.expect(mean.rate_deg_per_h, any.rate, all.rate, 2 * rate.known >= mean.samples);
    temperature.expect(mean.temperature_degc, any.temperature, all.temperature, true);
    uhfo.expect(mean.uhfo_v, any.uhfo, all.uhfo, true);
    const SecondMean used = without_implausible(mean);
    EXPECT_EQ(std::isnan(used.temperature_degc), all.temperature || std::isnan(mean.temperature_degc));
    EXPECT_EQ(std::isnan(used.uhfo_v), all.uhfo || std::isnan(mean.uhfo_v));
  }
}

TEST(SecondAverager, AnInfiniteValueIsIgnored) {
  Sample broken = sample_at(1, HUGE_VAL);
  broken.temperature_degc = -HUGE_VAL;
  SecondAverager averager;
  averager.push(broken);
  averager.push(sample_at(2, 7));
  const SecondMean second_mean = averager.finish().value();
  EXPECT_DOUBLE_EQ(second_mean.rate_deg_per_h, 7);
  EXPECT_TRUE(std::isnan(second_mean.temperature_degc));
}

}  // namespace
}  // namespace prism::compensation
