// SPDX-License-Identifier: MIT
#include "daemon/pipeline/rate_monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace prism::pipeline {
namespace {

constexpr std::size_t kSeconds = 30;
constexpr double kTolerance = 0.1;
constexpr double kLeastRateHz = 2;  // below: a second has too few frames to count

bool near(double count, double other) { return std::abs(count - other) <= std::max(kTolerance * other, 1.0); }

}  // namespace

std::optional<std::string> RateMonitor::push(std::uint32_t samples) {
  if (reported_ || rate_hz_ < kLeastRateHz) return std::nullopt;
  seconds_.push_back(samples);
  if (seconds_.size() < kSeconds) return std::nullopt;
  std::vector<std::uint32_t> sorted = std::move(seconds_);
  seconds_.clear();
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted[sorted.size() / 2];
  const auto alike = std::count_if(sorted.begin(), sorted.end(), [&](double count) { return near(count, median); });
  if (near(median, rate_hz_) || static_cast<double>(alike) < (1 - kTolerance) * kSeconds) return std::nullopt;
  reported_ = true;
  return fmt::format(
      "found {} gyro frames a second by their time stamps, expected {:g} (rate_hz): rate_hz is wrong, or frames are "
      "lost all the time",
      median, rate_hz_);
}

}  // namespace prism::pipeline
