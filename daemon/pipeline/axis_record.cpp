// SPDX-License-Identifier: MIT
#include "daemon/pipeline/axis_record.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace prism::pipeline {
namespace {

void watch_plausibility(const compensation::CompensatedWindow& row, const std::string& prefix, Problems& problems) {
  const compensation::SecondMean& now = row.window.second_mean;
  for (const AxisSensor& sensor : kAxisSensors) {
    if (!(now.implausible.*sensor.in_set) && problems.empty()) continue;
    const std::string name = prefix + sensor.name, key = "implausible " + name;
    if (now.implausible.*sensor.in_set) {
      problems.set(key,
                   {.kind = "implausible",
                    .text = fmt::format("{} is implausible: {}", name,
                                        compensation::rejection_text(row.rejections.*sensor.rejection, sensor.unit)),
                    .unit = "s",
                    .count = 1});
    } else if (const std::uint64_t seconds = problems.find(key).count;
               seconds > 0 && std::isfinite(now.*sensor.value)) {
      problems.clear(key,
                     fmt::format("{} is plausible again: {:.6g} {} after {} implausible seconds", name,
                                 now.*sensor.value, sensor.unit, seconds),
                     AxisRecord::kCalmS);
    }
  }
}

}  // namespace

void AxisRecord::keep(const compensation::CompensatedWindow& row, std::int64_t session_ns, int block_s) {
  if (log) log->append(row, session_ns);
  stability.add(row, block_s);
  ++seconds;
  windows += row.window.state == compensation::WindowState::kReady;
  corrected += std::isfinite(row.corrected_deg_per_h);
  last_window = row;
}

// Only changes of quality are events. Implausible values have their own events.
void AxisRecord::watch(const compensation::CompensatedWindow& row, const Tell& tell, Problems& problems) {
  const std::uint32_t quality = row.correction.quality & ~compensation::kImplausible;
  if (std::exchange(last_quality, quality) != quality) {
    const bool harmless =
        quality == compensation::kGood || quality == compensation::kWarming || quality == compensation::kNoModel;
    tell(harmless ? Severity::kInfo : Severity::kWarning, "quality",
         prefix + "quality is now " + compensation::quality_text(quality));
  }
  watch_plausibility(row, prefix, problems);
  changes.push(row, prefix, problems);
}

}  // namespace prism::pipeline
