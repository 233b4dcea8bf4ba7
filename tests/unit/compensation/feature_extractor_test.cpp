// SPDX-License-Identifier: MIT
// FeatureExtractor: slopes and responses of known histories, and a simple reference over random ones.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "compensation/features.hpp"

namespace prism::compensation {
namespace {

constexpr double kMeanRounding = 1e-11;  // means of 100 doubles below 100

SecondMean second_mean_at(std::int64_t second, double temperature_degc) {
  SecondMean second_mean;
  second_mean.second = second;
  second_mean.rate_deg_per_h = 8;
  second_mean.temperature_degc = temperature_degc;
  return second_mean;
}

// T = a s². Difference: ((mean of s² over the end) − (the same L before)) / L = a (2 m − L), m the end's mean time.
// Least squares over L equally spaced points: the slope at their centre, 2 a c. The two differ on purpose.
TEST(FeatureExtractor, TheMethodsDifferOnACurveAccordingToTheirFormulas) {
  constexpr double kA = 1e-4;
  FeatureDefinition least_squares;
  least_squares.slope = SlopeMethod::kLeastSquares;
  FeatureExtractor by_difference({}), by_least_squares(least_squares);
  Window d, l;
  for (int s = 0; s <= 300; ++s) {
    d = by_difference.push(second_mean_at(s, kA * s * s));
    l = by_least_squares.push(second_mean_at(s, kA * s * s));
  }
  EXPECT_NEAR(d.slope_degc_per_s, kA * (2 * (300 - 4.5) - 100), kMeanRounding);
  EXPECT_NEAR(l.slope_degc_per_s, kA * 2 * (300 - 49.5), kMeanRounding);
}

// After a step of 30 degC the body is 30 exp(−n / tau) behind, and `settling` for 3 tau.
TEST(FeatureExtractor, AResponseFollowsItsClosedForm) {
  FeatureDefinition features;
  features.length_s = 1, features.end_mean_s = 1;
  features.sensors = {{"case", "degC"}};
  features.response_s = 400;
  const auto list = std::make_shared<const std::vector<SensorName>>(features.sensors);
  FeatureExtractor extractor(features);
  for (int n = 0; n < 2000; ++n) {
    SecondMean mean = second_mean_at(n, n == 0 ? 20 : 50);
    mean.sensor_list = list;
    mean.sensors = {n == 0 ? 20.0 : 50.0};
    const Window window = extractor.push(mean);
    ASSERT_NEAR(window.temperature_degc, 50 - 30 * std::exp(-n / 400.0), kMeanRounding) << n;
    ASSERT_EQ(window.sensors.at(0).mean, mean.sensors.at(0)) << n;
    ASSERT_EQ(window.second_mean.temperature_degc, mean.temperature_degc);
    ASSERT_EQ(window.settling, n < 1200) << n;
  }
}

constexpr double kReferenceRounding = 1e-10;

using Quantity = double SecondMean::*;

// Keeps all seconds since the window was last emptied.
class Reference {
 public:
  explicit Reference(FeatureDefinition definition) : definition_(std::move(definition)) {}

  Window push(const SecondMean& measured) {
    Window window;
    const SecondMean second_mean = with_body(measured, window);
    if (!kept_.empty() && second_mean.second > last()) window.gap_s = static_cast<int>(second_mean.second - last()) - 1;
    const bool goes_on = !kept_.empty() && second_mean.second > last() && window.gap_s <= definition_.max_gap_s;
    if (!goes_on) kept_.clear();
    kept_[second_mean.second] = second_mean;
    const std::int64_t first = std::max(last() - definition_.length_s + 1, kept_.begin()->first);
    window.rate_deg_per_h = mean(&SecondMean::rate_deg_per_h, first, last());
    window.temperature_degc =
        has_hole(&SecondMean::temperature_degc, first) ? kUnknown : mean(&SecondMean::temperature_degc, first, last());
    window.uhfo_v = has_hole(&SecondMean::uhfo_v, first) ? kUnknown : mean(&SecondMean::uhfo_v, first, last());
    const bool full = last() - kept_.begin()->first + 1 >= history_s(definition_);
    window.warm_s = std::min(static_cast<int>(last() - kept_.begin()->first) + 1, history_s(definition_));
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

  // The body is behind by a difference that decays with the elapsed time.
  SecondMean with_body(SecondMean second_mean, Window& window) {
    const double degc = second_mean.temperature_degc;
    if (definition_.response_s == 0 || std::isnan(degc)) return second_mean;
    const std::int64_t tau = definition_.response_s, step = last_body_ ? second_mean.second - last_body_->first : 0;
    if (step <= 0 || step > std::max<std::int64_t>(definition_.max_gap_s + 1, tau / 10)) {
      behind_ = 0, body_begin_ = second_mean.second;
    } else {
      behind_ = (behind_ + degc - last_body_->second) * std::exp(-static_cast<double>(step) / static_cast<double>(tau));
    }
    last_body_ = {second_mean.second, degc};
    second_mean.temperature_degc = degc - behind_;
    window.settling = second_mean.second - body_begin_ < 3 * tau;
    return second_mean;
  }

  FeatureDefinition definition_;
  std::map<std::int64_t, SecondMean> kept_;
  double behind_ = 0;
  std::optional<std::pair<std::int64_t, double>> last_body_;
  std::int64_t body_begin_ = 0;
};

void expect_alike(double a, double b, const char* what) {
  ASSERT_EQ(std::isfinite(a), std::isfinite(b)) << what;
  if (std::isfinite(b)) {
    ASSERT_NEAR(a, b, kReferenceRounding) << what;
  }
}

// Gaps, clocks that were set back, failed and implausible values, and resets.
TEST(FeatureExtractor, EqualsAReferenceThatKeepsAllSeconds) {
  std::mt19937_64 random(41);
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  int ready = 0;
  for (int trial = 0; trial < 60; ++trial) {
    FeatureDefinition definition;
    definition.slope = trial % 2 ? SlopeMethod::kDifference : SlopeMethod::kLeastSquares;
    definition.length_s = 1 + below(41);
    definition.end_mean_s = trial % 4 < 2 ? 1 : 1 + below(static_cast<unsigned>(definition.length_s));
    definition.max_gap_s = below(8);
    if (trial % 5 < 2) definition.response_s = 1 + below(100);
    const int full = definition.length_s + (trial % 2 ? definition.end_mean_s : 0);
    ASSERT_EQ(history_s(definition), full);
    FeatureExtractor extractor(definition), without_ready(definition);
    Reference reference(definition);
    std::int64_t second = 0;
    bool temperature = true, uhfo = true, rate = true;
    for (int i = 0; i < 1500; ++i) {
      second += below(60) ? 1 : below(12) - 1;
      const bool has_faults = trial % 3 > 0;  // without them, only gaps matter
      if (has_faults && below(70) == 0) temperature = !temperature;
      if (!temperature && below(6) == 0) temperature = true;
      if (has_faults && below(70) == 0) uhfo = !uhfo;
      if (has_faults && below(70) == 0) rate = !rate;
      SecondMean second_mean;
      second_mean.second = second;
      second_mean.temperature_degc = temperature ? 20 + 0.01 * below(1000) : kUnknown;
      second_mean.uhfo_v = uhfo ? 5 + 0.001 * below(1000) : kUnknown;
      second_mean.rate_deg_per_h = rate ? 8 + 0.001 * below(1000) : kUnknown;
      if (below(500) == 0) {  // as new
        extractor.reset(), without_ready.reset();
        reference = Reference(definition);
      }
      const Window expected = reference.push(second_mean);
      if (std::isnan(second_mean.temperature_degc) && below(2)) {
        second_mean.temperature_degc = -273;  // the row contains the measured value, the window ignores it
        second_mean.all_implausible.temperature = true;
      }
      const Window window = extractor.push(second_mean);
      const auto unready = without_ready.push_unless_ready(second_mean);
      ASSERT_EQ(unready.has_value(), expected.state == WindowState::kWarming) << "trial " << trial << ", push " << i;
      ASSERT_EQ(window.state, expected.state) << "trial " << trial << ", push " << i;
      expect_alike(window.rate_deg_per_h, expected.rate_deg_per_h, "rate");
      expect_alike(window.temperature_degc, expected.temperature_degc, "temperature");
      expect_alike(window.slope_degc_per_s, expected.slope_degc_per_s, "slope");
      expect_alike(window.uhfo_v, expected.uhfo_v, "uhfo");
      ASSERT_EQ(window.warm_s, expected.warm_s) << "trial " << trial << ", push " << i;
      ASSERT_EQ(window.gap_s, expected.gap_s);
      ASSERT_EQ(window.settling, expected.settling);
      expect_alike(window.second_mean.temperature_degc, second_mean.temperature_degc, "row");
      if (HasFatalFailure()) FAIL() << "trial " << trial << ", push " << i;
      if (window.state == WindowState::kReady) ++ready;
    }
  }
  EXPECT_GT(ready, 10'000);  // most windows were measured, not only warming
}

TEST(Features, HaveTheThreeInputsOfThePaper) {
  Window window;
  window.temperature_degc = 1;
  window.slope_degc_per_s = 2;
  window.uhfo_v = 3;
  double expected = 0;
  for (const std::string name : {"T", "dTdt", "U"}) {
    EXPECT_TRUE(has_input({}, name)) << name;
    EXPECT_EQ(input_value(window, {}, name), ++expected) << name;
    EXPECT_TRUE(std::isnan(input_value({}, {}, name))) << name;
  }
  for (const std::string name : {"", "t", "u", "dT/dt", "T ", "T-U"})
    EXPECT_FALSE(has_input({}, name)) << '"' << name << '"';
}

}  // namespace
}  // namespace prism::compensation
