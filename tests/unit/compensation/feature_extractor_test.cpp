// SPDX-License-Identifier: MIT
// FeatureExtractor: mean and slope of a given temperature history; gaps, warming and failed sensors.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "compensation/features.hpp"

namespace prism::compensation {
namespace {

constexpr double kMeanRounding = 1e-11;  // means of 100 doubles below 100
constexpr std::int64_t kStart = 1'795'425'059;

FeatureDefinition definition(SlopeMethod slope, int length_s = 100, int end_mean_s = 10, int max_gap_s = 5) {
  FeatureDefinition result;
  result.slope = slope;
  result.length_s = length_s;
  result.end_mean_s = end_mean_s;
  result.max_gap_s = max_gap_s;
  return result;
}

SecondMean second_mean_at(std::int64_t second, double temperature_degc, double rate_deg_per_h = 8,
                          double uhfo_v = 5.3) {
  SecondMean second_mean;
  second_mean.second = second;
  second_mean.samples = 1;
  second_mean.rate_deg_per_h = rate_deg_per_h;
  second_mean.temperature_degc = temperature_degc;
  second_mean.uhfo_v = uhfo_v;
  return second_mean;
}

// T(t) = 20 + slope · t, t in seconds since kStart.
double ramp(std::int64_t second, double slope_degc_per_s) {
  return 20 + slope_degc_per_s * static_cast<double>(second - kStart);
}

// Pushes the seconds [from, to) of a ramp and returns the last window.
Window push_ramp(FeatureExtractor& extractor, std::int64_t from, std::int64_t to, double slope_degc_per_s) {
  Window window;
  for (std::int64_t s = from; s < to; ++s) window = extractor.push(second_mean_at(s, ramp(s, slope_degc_per_s)));
  return window;
}

class BothMethods : public testing::TestWithParam<SlopeMethod> {};
INSTANTIATE_TEST_SUITE_P(FeatureExtractor, BothMethods,
                         testing::Values(SlopeMethod::kDifference, SlopeMethod::kLeastSquares), [](const auto& row) {
                           return row.param == SlopeMethod::kDifference ? "Difference" : "LeastSquares";
                         });

TEST_P(BothMethods, FindTheSlopeOfARamp) {
  for (const double slope : {1.0 / 60, -1.0 / 60, 0.0, 1e-6}) {
    for (const auto& [length, end] : {std::pair{100, 10}, {100, 1}, {100, 100}, {2, 1}, {600, 30}}) {
      FeatureExtractor extractor(definition(GetParam(), length, end));
      const Window window = push_ramp(extractor, kStart, kStart + 2 * length + 1, slope);
      ASSERT_EQ(window.state, WindowState::kReady) << length;
      EXPECT_NEAR(window.slope_degc_per_s, slope, kMeanRounding) << length;
      // The mean of a ramp is its value in the middle of the window, (length - 1) / 2 seconds before its last second.
      EXPECT_NEAR(window.temperature_degc, ramp(kStart + 2 * length, slope) - slope * (length - 1) / 2.0,
                  kMeanRounding);
    }
  }
}

TEST_P(BothMethods, WarmForExactlyTheirHistory) {
  const FeatureDefinition features = definition(GetParam(), 20, 4);
  const int full = GetParam() == SlopeMethod::kDifference ? 24 : 20;
  ASSERT_EQ(history_s(features), full);
  FeatureExtractor extractor(features);
  for (int s = 0; s < 60; ++s) {
    const Window window = extractor.push(second_mean_at(kStart + s, 25));
    EXPECT_EQ(window.warm_s, std::min(s + 1, full));
    EXPECT_EQ(window.state, s + 1 < full ? WindowState::kWarming : WindowState::kReady) << s;
    EXPECT_EQ(std::isfinite(window.slope_degc_per_s), s + 1 >= full) << s;
  }
}

TEST_P(BothMethods, KeepTheWindowOverAGapAtTheLimit) {
  for (int hole = 1; hole <= 5; ++hole) {
    FeatureExtractor extractor(definition(GetParam()));
    push_ramp(extractor, kStart, kStart + 150, 0.01);
    for (int s = 150 + hole; s < 400; ++s) {
      const Window window = push_ramp(extractor, kStart + s, kStart + s + 1, 0.01);
      EXPECT_EQ(window.gap_s, s == 150 + hole ? hole : 0);
      // Always ready, also while the gap passes the ends of the window, and with the slope of the ramp.
      ASSERT_EQ(window.state, WindowState::kReady) << "gap " << hole << ", second " << s;
      ASSERT_NEAR(window.slope_degc_per_s, 0.01, kMeanRounding) << "gap " << hole << ", second " << s;
    }
  }
}

TEST_P(BothMethods, EmptyTheWindowOverAGapAboveTheLimit) {
  FeatureExtractor extractor(definition(GetParam()));
  push_ramp(extractor, kStart, kStart + 150, 0.01);
  Window window = push_ramp(extractor, kStart + 156, kStart + 157, 0.01);
  EXPECT_EQ(window.gap_s, 6);
  EXPECT_EQ(window.warm_s, 1);
  EXPECT_EQ(window.state, WindowState::kWarming);
  EXPECT_TRUE(std::isnan(window.slope_degc_per_s));
  EXPECT_NEAR(window.temperature_degc, ramp(kStart + 156, 0.01), kMeanRounding);  // nothing from before the gap
  const int full = history_s(extractor.definition());
  window = push_ramp(extractor, kStart + 157, kStart + 156 + full - 1, 0.01);
  EXPECT_EQ(window.state, WindowState::kWarming);
  window = push_ramp(extractor, kStart + 156 + full - 1, kStart + 156 + full, 0.01);
  EXPECT_EQ(window.state, WindowState::kReady);
}

TEST_P(BothMethods, EmptyTheWindowIfTheClockIsSetBackOrStops) {
  for (const int back : {0, 1, 1000}) {
    FeatureExtractor extractor(definition(GetParam()));
    push_ramp(extractor, kStart, kStart + 200, 0.01);
    const Window window = extractor.push(second_mean_at(kStart + 199 - back, -40));
    EXPECT_EQ(window.state, WindowState::kWarming);
    EXPECT_EQ(window.warm_s, 1);
    EXPECT_EQ(window.gap_s, 0);
    EXPECT_DOUBLE_EQ(window.temperature_degc, -40);
  }
}

TEST_P(BothMethods, DoNotUseTheTemperatureOfAFailedSensor) {
  FeatureExtractor extractor(definition(GetParam()));
  push_ramp(extractor, kStart, kStart + 200, 0.01);
  for (int s = 200; s < 400; ++s) {
    const Window window = extractor.push(second_mean_at(kStart + s, kUnknown));
    const bool within_limit = s < 205;
    EXPECT_EQ(std::isfinite(window.temperature_degc), within_limit) << s;
    EXPECT_EQ(std::isfinite(window.slope_degc_per_s), within_limit) << s;
    EXPECT_EQ(window.state, within_limit ? WindowState::kReady : WindowState::kWarming) << s;
    EXPECT_EQ(window.warm_s, history_s(extractor.definition())) << s;  // the stream itself has no gap
  }
}

TEST_P(BothMethods, AcceptATemperatureEveryFifthSecond) {
  FeatureExtractor extractor(definition(GetParam()));
  for (int s = 0; s < 300; ++s) {
    const Window window = extractor.push(second_mean_at(kStart + s, s % 5 == 0 ? ramp(kStart + s, -0.02) : kUnknown));
    if (s < 150) continue;
    ASSERT_EQ(window.state, WindowState::kReady) << s;
    ASSERT_NEAR(window.slope_degc_per_s, -0.02, kMeanRounding) << s;
  }
}

TEST_P(BothMethods, AreTheSameAfterAResetAsNew) {
  FeatureDefinition features = definition(GetParam(), 30, 3);
  features.lag_time_constants_s = {50};
  FeatureExtractor used(features), fresh(features);
  push_ramp(used, kStart - 100, kStart, 0.01);
  used.reset();
  for (std::int64_t s = kStart; s < kStart + 100; ++s) {
    const Window a = used.push(second_mean_at(s, ramp(s, 0.003)));
    const Window b = fresh.push(second_mean_at(s, ramp(s, 0.003)));
    ASSERT_EQ(a.state, b.state);
    ASSERT_EQ(a.warm_s, b.warm_s);
    ASSERT_EQ(a.gap_s, 0);
    ASSERT_DOUBLE_EQ(a.temperature_degc, b.temperature_degc);
    ASSERT_EQ(a.lag_degc, b.lag_degc);
    ASSERT_EQ(a.lag_settling, b.lag_settling);
  }
}

// T = a s². Difference: ((mean of s² over the end) − (the same L before)) / L = a (2 m − L), m the end's mean time.
// Least squares over L equally spaced points: the slope at their centre, 2 a c. The two differ on purpose.
TEST(FeatureExtractor, TheMethodsDifferOnACurveAccordingToTheirFormulas) {
  constexpr double kA = 1e-4;
  const FeatureDefinition difference = definition(SlopeMethod::kDifference, 100, 10);
  const FeatureDefinition least_squares = definition(SlopeMethod::kLeastSquares, 100, 10);
  FeatureExtractor by_difference(difference), by_least_squares(least_squares);
  Window d, l;
  for (int s = 0; s <= 300; ++s) {
    d = by_difference.push(second_mean_at(s, kA * s * s));
    l = by_least_squares.push(second_mean_at(s, kA * s * s));
  }
  EXPECT_NEAR(d.slope_degc_per_s, kA * (2 * (300 - 4.5) - 100), kMeanRounding);
  EXPECT_NEAR(l.slope_degc_per_s, kA * 2 * (300 - 49.5), kMeanRounding);
}

TEST(FeatureExtractor, AnEndCompletelyInAGapHasNoSlopeForThatSecond) {
  FeatureExtractor extractor(definition(SlopeMethod::kDifference, 100, 1));
  push_ramp(extractor, kStart, kStart + 150, 0.01);
  for (int s = 152; s < 300; ++s) {  // the seconds 150 and 151 are missing
    const Window window = push_ramp(extractor, kStart + s, kStart + s + 1, 0.01);
    EXPECT_EQ(window.state == WindowState::kWarming, s == 250 || s == 251) << s;
  }
}

TEST(FeatureExtractor, AStreamWithoutUhfoIsReadyWithoutItsMean) {
  FeatureExtractor extractor(definition(SlopeMethod::kDifference));
  Window window;
  for (int s = 0; s < 120; ++s) window = extractor.push(second_mean_at(kStart + s, 25, 8, kUnknown));
  EXPECT_EQ(window.state, WindowState::kReady);
  EXPECT_TRUE(std::isnan(window.uhfo_v));
}

TEST(FeatureExtractor, TheVoltageOfAFailedMeterIsUnknownUntilItsWindowHasDataAgain) {
  FeatureExtractor extractor(definition(SlopeMethod::kDifference));
  for (int s = 0; s < 400; ++s) {
    const bool failed = s >= 200 && s < 206;  // one second above the limit
    const Window window = extractor.push(second_mean_at(kStart + s, 25, 8, failed ? kUnknown : 5 + (s >= 206 ? 1 : 0)));
    const bool gap_in_window = s >= 205 && s < 300;  // until fewer than six of its seconds are in the window
    EXPECT_EQ(std::isnan(window.uhfo_v), gap_in_window) << s;
    EXPECT_TRUE(s < 310 || window.uhfo_v == 6) << s;
  }
}

TEST(FeatureExtractor, WarmingReturnsMeansOfTheAvailableSeconds) {
  FeatureExtractor extractor(definition(SlopeMethod::kDifference));
  extractor.push(second_mean_at(kStart, 20, 7, 5.0));
  const Window window = extractor.push(second_mean_at(kStart + 1, 22, 9, 5.5));
  EXPECT_EQ(window.state, WindowState::kWarming);
  EXPECT_DOUBLE_EQ(window.temperature_degc, 21);
  EXPECT_DOUBLE_EQ(window.rate_deg_per_h, 8);
  EXPECT_DOUBLE_EQ(window.uhfo_v, 5.25);
}

TEST(FeatureExtractor, TheMeanRateExcludesInvalidRates) {
  FeatureExtractor extractor(definition(SlopeMethod::kDifference));
  Window window;
  for (int s = 0; s < 120; ++s) window = extractor.push(second_mean_at(kStart + s, 25, s % 2 ? kUnknown : 8));
  EXPECT_EQ(window.state, WindowState::kReady);
  EXPECT_DOUBLE_EQ(window.rate_deg_per_h, 8);
  for (int s = 120; s < 220; ++s) window = extractor.push(second_mean_at(kStart + s, 25, kUnknown));
  EXPECT_EQ(window.state, WindowState::kWarming);
  EXPECT_TRUE(std::isnan(window.rate_deg_per_h));
}

FeatureDefinition with_lags(std::vector<double> time_constants_s) {
  FeatureDefinition features = definition(SlopeMethod::kDifference, 10, 1);
  features.lag_time_constants_s = std::move(time_constants_s);
  return features;
}

TEST(ConditionerLag, AStepDecaysExponentially) {
  FeatureExtractor extractor(with_lags({25, 400}));
  for (int s = 0; s < 50; ++s) EXPECT_EQ(extractor.push(second_mean_at(s, 20)).lag_degc, (std::vector<double>{0, 0}));
  for (int n = 1; n <= 1000; ++n) {  // n seconds after the step of 30 degC: T − EMA = 30 exp(−n / tau)
    const Window window = extractor.push(second_mean_at(49 + n, 50));
    ASSERT_EQ(window.lag_degc.size(), 2u);
    ASSERT_NEAR(window.lag_degc[0], 30 * std::exp(-n / 25.0), kMeanRounding);
    ASSERT_NEAR(window.lag_degc[1], 30 * std::exp(-n / 400.0), kMeanRounding);
  }
}

// With k = exp(−1/tau) and T rising by r per second: y_n = k (y_(n−1) + r), so y_n = r k (1 − k^n) / (1 − k).
TEST(ConditionerLag, ARampLagsAccordingToTheClosedForm) {
  FeatureExtractor extractor(with_lags({60}));
  const double k = std::exp(-1 / 60.0), r = 0.02;
  for (int n = 0; n < 600; ++n) {
    const Window window = extractor.push(second_mean_at(n, 20 + r * n));
    ASSERT_NEAR(window.lag_degc.at(0), r * k * (1 - std::pow(k, n)) / (1 - k), kMeanRounding) << n;
  }
}

TEST(ConditionerLag, AShortGapIsBridgedByTheTrueElapsedTime) {
  FeatureExtractor extractor(with_lags({1000}));
  extractor.push(second_mean_at(0, 20));
  const Window window = extractor.push(second_mean_at(100, 30));  // a tenth of the time constant, above max_gap_s
  EXPECT_EQ(window.state, WindowState::kWarming);
  EXPECT_NEAR(window.lag_degc.at(0), 10 * std::exp(-0.1), kMeanRounding);
  const Window unknown = extractor.push(second_mean_at(101, kUnknown));
  EXPECT_TRUE(unknown.lag_degc.empty());  // without a temperature there is no lag, never that of the second before
  EXPECT_NEAR(extractor.push(second_mean_at(102, 30)).lag_degc.at(0), 10 * std::exp(-0.102), kMeanRounding);
}

TEST(ConditionerLag, ALongGapOrAClockSetBackRestarts) {
  for (const int next : {101, -1, 0}) {
    FeatureExtractor extractor(with_lags({1000, 5000}));
    extractor.push(second_mean_at(0, 20));
    const Window window = extractor.push(second_mean_at(next, 30));
    EXPECT_EQ(window.lag_degc, (std::vector<double>{0, 0})) << next;
    EXPECT_TRUE(window.lag_settling) << next;
  }
}

TEST(ConditionerLag, SettlesForThreeOfTheLongestTimeConstants) {
  FeatureExtractor extractor(with_lags({40, 7}));
  for (int s = 0; s < 200; ++s) EXPECT_EQ(extractor.push(second_mean_at(s, 20)).lag_settling, s < 120) << s;
}

TEST(ConditionerLag, WithoutLagsNothingSettles) {
  FeatureExtractor extractor(definition(SlopeMethod::kDifference));
  const Window window = extractor.push(second_mean_at(0, 20));
  EXPECT_FALSE(window.lag_settling);
  EXPECT_TRUE(window.lag_degc.empty());
}

constexpr double kReferenceRounding = 1e-10;

using Quantity = double SecondMean::*;

// All seconds since the window was last emptied.
class Reference {
 public:
  explicit Reference(FeatureDefinition definition) : definition_(std::move(definition)) {}

  Window push(const SecondMean& second_mean) {
    const bool goes_on =
        !kept_.empty() && second_mean.second > last() && second_mean.second - last() - 1 <= definition_.max_gap_s;
    if (!goes_on) kept_.clear();
    kept_[second_mean.second] = second_mean;
    Window window;
    const std::int64_t first = std::max(last() - definition_.length_s + 1, kept_.begin()->first);
    window.rate_deg_per_h = mean(&SecondMean::rate_deg_per_h, first, last());
    window.temperature_degc =
        has_hole(&SecondMean::temperature_degc, first) ? kUnknown : mean(&SecondMean::temperature_degc, first, last());
    window.uhfo_v = has_hole(&SecondMean::uhfo_v, first) ? kUnknown : mean(&SecondMean::uhfo_v, first, last());
    const bool full = last() - kept_.begin()->first + 1 >= history_s(definition_);
    if (full) window.slope_degc_per_s = slope();
    if (full && std::isfinite(window.slope_degc_per_s + window.temperature_degc + window.rate_deg_per_h)) {
      window.state = WindowState::kReady;
    }
    return window;
  }

 private:
  std::int64_t last() const { return kept_.rbegin()->first; }

  double at(Quantity quantity, std::int64_t second) const {
    const auto found = kept_.find(second);
    return found == kept_.end() ? kUnknown : found->second.*quantity;
  }

  double mean(Quantity quantity, std::int64_t first, std::int64_t end) const {
    double sum = 0, count = 0;
    for (std::int64_t s = first; s <= end; ++s) {
      if (std::isfinite(at(quantity, s))) sum += at(quantity, s), ++count;
    }
    return count > 0 ? sum / count : kUnknown;
  }

  bool has_hole(Quantity quantity, std::int64_t first, std::int64_t end) const {
    int unknown = 0, longest = 0;
    for (std::int64_t s = first; s <= end; ++s) {
      unknown = std::isfinite(at(quantity, s)) ? 0 : unknown + 1;
      longest = std::max(longest, unknown);
    }
    return longest > definition_.max_gap_s;
  }
  bool has_hole(Quantity quantity, std::int64_t first) const { return has_hole(quantity, first, last()); }

  // The line through the points (t, T): all of the window, or the means of both ends.
  double slope() const {
    const std::int64_t first = last() - definition_.length_s + 1;
    std::vector<std::pair<double, double>> points;
    const auto add_mean = [&](std::int64_t from, std::int64_t to) {
      double times = 0, sum = 0, count = 0;
      for (std::int64_t s = from; s <= to; ++s) {
        const double t = at(&SecondMean::temperature_degc, s);
        if (std::isfinite(t)) times += static_cast<double>(s), sum += t, ++count;
      }
      if (count > 0 && !has_hole(&SecondMean::temperature_degc, from, to))
        points.emplace_back(times / count, sum / count);
    };
    if (definition_.slope == SlopeMethod::kDifference) {
      add_mean(first - definition_.end_mean_s, first - 1);
      add_mean(last() - definition_.end_mean_s + 1, last());
    } else if (!has_hole(&SecondMean::temperature_degc, first)) {
      for (std::int64_t s = first; s <= last(); ++s) add_mean(s, s);
    }
    if (points.size() < 2) return kUnknown;
    double time = 0, temperature = 0, covariance = 0, variance = 0;
    for (const auto& [t, value] : points) time += t, temperature += value;
    time /= static_cast<double>(points.size()), temperature /= static_cast<double>(points.size());
    for (const auto& [t, value] : points) {
      covariance += (t - time) * (value - temperature), variance += (t - time) * (t - time);
    }
    return covariance / variance;
  }

  FeatureDefinition definition_;
  std::map<std::int64_t, SecondMean> kept_;
};

void expect_alike(double a, double b, const char* what) {
  ASSERT_EQ(std::isfinite(a), std::isfinite(b)) << what;
  if (std::isfinite(b)) {
    ASSERT_NEAR(a, b, kReferenceRounding) << what;
  }
}

TEST(FeatureExtractor, EqualsAReferenceThatKeepsAllSeconds) {
  std::mt19937_64 random(41);
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  int ready = 0;
  for (int trial = 0; trial < 60; ++trial) {
    FeatureDefinition definition;
    definition.slope = trial % 2 ? SlopeMethod::kDifference : SlopeMethod::kLeastSquares;
    definition.length_s = 1 + below(41);
    definition.end_mean_s = 1 + below(static_cast<unsigned>(definition.length_s));
    definition.max_gap_s = below(8);
    FeatureExtractor extractor(definition), without_ready(definition);
    Reference reference(definition);
    std::int64_t second = 0;
    bool temperature = true, uhfo = true, rate = true;
    for (int i = 0; i < 1500; ++i) {
      second += below(60) ? 1 : below(12) - 1;
      if (below(70) == 0) temperature = !temperature;
      if (!temperature && below(6) == 0) temperature = true;
      if (below(70) == 0) uhfo = !uhfo;
      if (below(70) == 0) rate = !rate;
      SecondMean second_mean;
      second_mean.second = second;
      second_mean.temperature_degc = temperature ? 20 + 0.01 * below(1000) : kUnknown;
      second_mean.uhfo_v = uhfo ? 5 + 0.001 * below(1000) : kUnknown;
      second_mean.rate_deg_per_h = rate ? 8 + 0.001 * below(1000) : kUnknown;
      const Window window = extractor.push(second_mean), expected = reference.push(second_mean);
      const auto unready = without_ready.push_unless_ready(second_mean);
      ASSERT_EQ(unready.has_value(), expected.state == WindowState::kWarming) << "trial " << trial << ", push " << i;
      ASSERT_EQ(window.state, expected.state) << "trial " << trial << ", push " << i;
      expect_alike(window.rate_deg_per_h, expected.rate_deg_per_h, "rate");
      expect_alike(window.temperature_degc, expected.temperature_degc, "temperature");
      expect_alike(window.slope_degc_per_s, expected.slope_degc_per_s, "slope");
      expect_alike(window.uhfo_v, expected.uhfo_v, "uhfo");
      if (HasFatalFailure()) FAIL() << "trial " << trial << ", push " << i;
      if (window.state == WindowState::kReady) ++ready;
    }
  }
  EXPECT_GT(ready, 10'000);  // most windows were measured, not only warming
}

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
