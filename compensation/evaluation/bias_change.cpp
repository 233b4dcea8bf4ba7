// SPDX-License-Identifier: MIT
#include "compensation/evaluation/bias_change.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {
namespace {

constexpr double kDay_s = 86400, kCertain = 4, kExplained = 3, kMostCorrelation = 0.9;

/// Means of complete days, and the middle times of their values.
struct Days {
  std::vector<double> time, mean;
};
Days days_of(std::span<const double> time_s, std::span<const double> error) {
  Days days;
  const auto complete = [&](std::size_t begin) { return time_s.back() - time_s[begin] > 0.9 * kDay_s; };
  for (std::size_t begin = 0, end = 0; begin < error.size() && complete(begin); begin = end) {
    while (end < error.size() && time_s[end] < time_s[begin] + kDay_s) ++end;
    days.time.push_back(mean_of(time_s.subspan(begin, end - begin)) / kDay_s);
    days.mean.push_back(mean_of(error.subspan(begin, end - begin)));
  }
  return days;
}

/// Slope per day, if it is certain.
std::optional<BiasChange::Estimate> trend_of(const Days& days) {
  if (days.mean.size() < kFewestDays) return std::nullopt;
  const double time = mean_of(days.time), level = mean_of(days.mean), n = static_cast<double>(days.mean.size());
  double squares = 0, product = 0, left_squares = 0;
  for (std::size_t i = 0; i < days.mean.size(); ++i) {
    squares += (days.time[i] - time) * (days.time[i] - time);
    product += (days.time[i] - time) * (days.mean[i] - level);
  }
  const double slope = product / squares;
  std::vector<double> left;
  for (std::size_t i = 0; i < days.mean.size(); ++i) {
    left.push_back(days.mean[i] - level - slope * (days.time[i] - time));
    left_squares += left.back() * left.back();
  }
  const double r = std::clamp(neighbour_correlation(left), 0.0, kMostCorrelation);
  const double sd = std::sqrt(left_squares / (n - 2) / squares * (1 + r) / (1 - r));
  return std::abs(slope) > kCertain * sd ? std::optional(BiasChange::Estimate{slope, sd}) : std::nullopt;
}

}  // namespace

BiasChange bias_change(std::span<const double> time_s, std::span<const double> error, std::span<const double> sd,
                       std::span<const double> sd_mean, double mount_sd) {
  BiasChange change;
  change.per_day = trend_of(days_of(time_s, error));
  const double level = mean_of(error), time = mean_of(time_s);
  double variance = mount_sd * mount_sd;
  for (const double one : sd) variance += one * one / static_cast<double>(sd.size());
  if (!change.per_day && std::abs(level) > kExplained * std::sqrt(variance)) change.shift = level;
  std::vector<double> rest(error.begin(), error.end());
  std::size_t within = 0;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    if (change.found()) rest[i] -= level;
    if (change.per_day) rest[i] -= change.per_day->value * (time_s[i] - time) / kDay_s;
    within += std::abs(rest[i]) <= 2 * sd_mean[i];
  }
  change.within = static_cast<double>(within) / static_cast<double>(rest.size());
  change.correlation = neighbour_correlation(rest);
  return change;
}

}  // namespace prism::evaluation
