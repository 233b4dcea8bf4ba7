// SPDX-License-Identifier: MIT
// FeatureExtractor compared with a simple reference that keeps every second and evaluates the complete window.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "compensation/feature_extractor.hpp"

namespace prism::compensation {
namespace {

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

}  // namespace
}  // namespace prism::compensation
