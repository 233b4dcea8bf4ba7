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

std::string clocks_text(const wire::FrameDescription& frames, const drivers::FrameRateCheck& check) {
  if (!check.differs()) return {};
  if (!frames.counts_frames())
    return fmt::format(
        "the gyro's time tags advance {:.3g} s in a second of arrivals, expected 1: ticks_per_s is wrong",
        check.ratio());
  return fmt::format("frames arrive at {:.2f} a second, the description says {:g} (rate_hz)",
                     check.ratio() * frames.counted_rate_hz(), frames.counted_rate_hz());
}

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
