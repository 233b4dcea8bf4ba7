// SPDX-License-Identifier: MIT
#include "daemon/pipeline/sensor_feed.hpp"

#include <algorithm>
#include <cmath>

namespace prism::pipeline {

SensorFeed::SensorFeed(const Setup::SensorLine& line)
    : decoder_(line.frames), stale_ns_(std::llround(line.stale_after_s * 1e9)) {}

void SensorFeed::begin_session(std::int64_t now_ns) {
  decoder_.reset();
  if (!values_.empty() && values_.back().arrival_ns > now_ns) values_.clear();
}

// A frame that waits for its end or for a second frame is completed by later bytes, never by a timer: a replay has
// none.
void SensorFeed::feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns, std::int64_t needed_since_ns,
                      std::int64_t latest_ns) {
  readings_.clear();
  decoder_.feed(bytes, arrival_ns, readings_);
  if (readings_.empty()) return;
  const auto& values = readings_.back().sensors;
  values_.push_back({arrival_ns, {values.begin(), values.begin() + static_cast<std::ptrdiff_t>(sensors())}});
  forget(needed_since_ns, latest_ns);
}

void SensorFeed::forget(std::int64_t needed_since_ns, std::int64_t latest_ns) {
  const auto before_last = [&] { return values_.end() - 2; };
  while (values_.size() >= 2 && before_last()->arrival_ns > latest_ns) values_.erase(before_last());
  while (values_.size() >= 2 && values_[1].arrival_ns <= needed_since_ns) values_.pop_front();
}

void SensorFeed::values_at(std::int64_t at_ns, std::span<double> values) const {
  const auto found =
      std::find_if(values_.rbegin(), values_.rend(), [&](const Values& one) { return one.arrival_ns <= at_ns; });
  if (found == values_.rend() || at_ns - found->arrival_ns > stale_ns_) {
    std::fill(values.begin(), values.end(), kUnknown);
  } else {
    std::copy(found->values.begin(), found->values.end(), values.begin());
  }
}

std::optional<std::int64_t> SensorFeed::last_ns() const {
  return values_.empty() ? std::nullopt : std::optional(values_.back().arrival_ns);
}

}  // namespace prism::pipeline
