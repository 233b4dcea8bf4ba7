// SPDX-License-Identifier: MIT
#include "daemon/pipeline/plausibility_watch.hpp"

#include <fmt/format.h>

#include <cmath>

namespace prism::pipeline {
namespace {

struct Sensor {
  const char *name, *unit;
  bool QuantitySet::*in_set;
  compensation::Doubt compensation::Doubts::*doubt;
  double compensation::Bucket::*value;
};

constexpr std::array kSensors = {
    Sensor{"rate", "deg/h", &QuantitySet::rate, &compensation::Doubts::rate, &compensation::Bucket::rate_deg_per_h},
    Sensor{"temperature", "degC", &QuantitySet::temperature, &compensation::Doubts::temperature,
           &compensation::Bucket::temperature_degc},
    Sensor{"uhfo", "V", &QuantitySet::uhfo, &compensation::Doubts::uhfo, &compensation::Bucket::uhfo_v}};

}  // namespace

std::vector<PlausibilityWatch::Notice> PlausibilityWatch::push(const compensation::CompensatedWindow& row) {
  std::vector<Notice> notices;
  const compensation::Bucket& bucket = row.window.bucket;
  for (std::size_t i = 0; i < kSensors.size(); ++i) {
    const Sensor& sensor = kSensors[i];
    Episode& episode = episodes_[i];
    if (bucket.implausible.*sensor.in_set) {
      if (!episode.open) {
        episode = {true, 0, 0};
        notices.push_back({true, fmt::format("{} is implausible: {}", sensor.name,
                                             compensation::doubt_text(row.doubts.*sensor.doubt, sensor.unit))});
      }
      ++episode.implausible_s;
      episode.calm_s = 0;
    } else if (episode.open && std::isfinite(bucket.*sensor.value) && ++episode.calm_s >= kCalmS) {
      episode.open = false;
      notices.push_back({false, fmt::format("{} is plausible again: {:.6g} {} after {} implausible seconds",
                                            sensor.name, bucket.*sensor.value, sensor.unit, episode.implausible_s)});
    }
  }
  return notices;
}

}  // namespace prism::pipeline
