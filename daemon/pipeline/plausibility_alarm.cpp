// SPDX-License-Identifier: MIT
#include "daemon/pipeline/plausibility_alarm.hpp"

#include <fmt/format.h>

#include <cmath>

#include "daemon/pipeline/axis_sensors.hpp"

namespace prism::pipeline {
std::vector<Notice> PlausibilityAlarm::push(const compensation::CompensatedWindow& row) {
  std::vector<Notice> notices;
  const compensation::SecondMean& second_mean = row.window.second_mean;
  for (std::size_t i = 0; i < kAxisSensors.size(); ++i) {
    const AxisSensor& sensor = kAxisSensors[i];
    Episode& episode = episodes_[i];
    if (second_mean.implausible.*sensor.in_set) {
      if (!episode.open) {
        episode = {true, 0, 0};
        notices.push_back(
            {true, fmt::format("{} is implausible: {}", sensor.name,
                               compensation::rejection_text(row.rejections.*sensor.rejection, sensor.unit))});
      }
      ++episode.implausible_s;
      episode.calm_s = 0;
    } else if (episode.open && std::isfinite(second_mean.*sensor.value) && ++episode.calm_s >= kCalmS) {
      episode.open = false;
      notices.push_back(
          {false, fmt::format("{} is plausible again: {:.6g} {} after {} implausible seconds", sensor.name,
                              second_mean.*sensor.value, sensor.unit, episode.implausible_s)});
    }
  }
  return notices;
}

}  // namespace prism::pipeline
