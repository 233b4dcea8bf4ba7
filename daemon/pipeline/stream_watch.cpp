// SPDX-License-Identifier: MIT
#include "daemon/pipeline/stream_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/text_number.hpp"
#include "drivers/wire/decode/inspect.hpp"

namespace prism::pipeline {
namespace {

constexpr std::uint64_t kLeastInput = 10;

std::string no_frame(const Pipeline& pipeline, std::uint64_t bytes, std::uint64_t refused, std::uint64_t single) {
  if (refused > 0)
    return fmt::format("{} frames of {} with a fault of the device (its description refuses them), and no good one",
                       refused, pipeline.decoder().description().name);
  if (single >= kLeastInput)
    return fmt::format("{} bytes and no frame of {}: {}", bytes, pipeline.decoder().description().name,
                       wire::single_frames_text(single));
  return fmt::format("{} bytes and no frame of {}: wrong description or line settings (prismd --sniff finds them)",
                     bytes, pipeline.decoder().description().name);
}

std::string no_sample(std::uint64_t frames, std::uint64_t repeated) {
  if (repeated > frames / 2)
    return fmt::format("{} frames and no rate: {} have the counter or time tag of the frame before", frames, repeated);
  return fmt::format("{} frames and no rate: they do not contain the gyro's data", frames);
}

std::string no_rate(const Pipeline& pipeline, std::size_t axis, std::uint64_t samples) {
  const std::string& example = pipeline.decoder().unread_text();
  return fmt::format("{} frames and no number for axis {}{}", samples, pipeline.axes()[axis].name,
                     example.empty() ? ": invalid, or out of the field's range" : ", for example \"" + example + "\"");
}

using compensation::SecondMean;

// Means of the same number in another number of samples differ by rounding.
bool same(double a, double b) { return std::fabs(a - b) <= 1e-12 * std::fabs(a); }

bool is_nearer(double value, double to, double than) { return std::fabs(value - to) < std::fabs(value - than); }

std::string jump_key(const std::string& prefix, const AxisSensor& sensor) { return "jump " + prefix + sensor.name; }

void begin(const SensorChanges::Place& place, const std::string& key, std::string text) {
  place.problems.set(key, {.kind = "question", .part = place.axis, .text = std::move(text)});
}

}  // namespace

StageMonitor::Counts StageMonitor::counts_of(const Pipeline& pipeline) {
  const wire::DecoderCounters& line = pipeline.decoder().counters();
  const drivers::ClockStatus& clock = pipeline.clock().status();
  Counts counts{{line.bytes, line.frames, clock.samples}, line.refused, line.unconfirmed, clock.duplicates};
  for (const Axis& axis : pipeline.axes()) counts.stages.push_back(axis.rates);
  return counts;
}

std::string StageMonitor::push(const Pipeline& pipeline, std::int64_t now_ns) {
  const Counts now = counts_of(pipeline);
  if (stages_.empty()) stages_.assign(now.stages.size() - 1, {now_ns, now});
  std::string problem;
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    auto& [since_ns, before] = stages_[i];
    const std::size_t in = std::min<std::size_t>(i, 2);  // the rates of each axis are of the samples
    const std::uint64_t input = now.stages[in] - before.stages[in];
    if (now.stages[i + 1] != before.stages[i + 1] || input == 0) {
      stages_[i] = {now_ns, now};
      continue;
    }
    const bool starved = input >= kLeastInput && static_cast<double>(now_ns - since_ns) >= 1e9 * kStarvedS;
    if (!starved || !problem.empty()) continue;
    problem = i == 0   ? no_frame(pipeline, input, now.refused - before.refused, now.single - before.single)
              : i == 1 ? no_sample(input, now.repeated - before.repeated)
                       : no_rate(pipeline, i - 2, input);
  }
  return problem;
}

std::string clocks_text(const wire::FrameDescription& frames, const drivers::FrameRateCheck& check) {
  if (!check.differs()) return {};
  if (!frames.counts_frames())
    return fmt::format(
        "the gyro's time tags advance {:.3g} s in a second of arrivals, expected 1: ticks_per_s is wrong",
        check.ratio());
  return fmt::format("frames arrive at {:.2f} a second, the description says {:g} (rate_hz)",
                     check.ratio() * frames.counted_rate_hz(), frames.counted_rate_hz());
}

std::string tagged_rate_text(const wire::FrameDescription& frames, const drivers::FrameRateCheck& check) {
  if (check.tagged_hz() == 0) return {};
  return fmt::format(
      "{}: found {:.4g} gyro frames a second by their time stamps, expected {:g} (rate_hz): rate_hz is wrong, or "
      "frames "
      "are lost all the time",
      frames.name, check.tagged_hz(), frames.rate_hz);
}

void SensorChanges::push(const compensation::CompensatedWindow& row, Place place) {
  const SecondMean& now = row.window.second_mean;
  const auto& sensors = sensors_of_list(now.sensor_list);
  still_.resize(kAxisSensors.size() + sensors.size());
  for (std::size_t i = 0; i < kAxisSensors.size(); ++i) {
    const AxisSensor& sensor = kAxisSensors[i];
    watch_jump(i, row, place);
    if (open_[i].open) seek_agreement(i, now, place);
    if (now.implausible.*sensor.in_set || !std::isfinite(now.*sensor.value)) continue;
    last_[i] = now.*sensor.value;
    watch_stillness(still_[i], last_[i], sensor.name, sensor.unit, i == 0 ? kStillRateS : kStillS, place);
  }
  if (now.sensors.size() != sensors.size()) return;
  last_sensors_ = now.sensors;
  for (std::size_t k = 0; k < sensors.size(); ++k)
    watch_stillness(still_[kAxisSensors.size() + k], now.sensors[k], sensors[k].name, sensors[k].unit, kStillS, place);
}

void SensorChanges::watch_jump(std::size_t i, const compensation::CompensatedWindow& row, Place place) {
  const AxisSensor& sensor = kAxisSensors[i];
  const SecondMean& now = row.window.second_mean;
  if (now.implausible.*sensor.in_set) {
    const bool was_rejecting = watch_[i].is_rejecting();
    watch_[i].reject(row.rejections.*sensor.rejection);
    if (!was_rejecting && watch_[i].is_rejecting()) latest_[i] = {{}, now.second, true, last_[i], last_sensors_};
  } else if (std::isfinite(now.*sensor.value)) {
    if (const auto jump = watch_[i].accept(now.*sensor.value)) begin_jump(i, *jump, now.second, place);
  }
}

// It stayed, or it ends an earlier jump.
void SensorChanges::begin_jump(std::size_t i, const compensation::JumpWatch::Jump& values, std::int64_t second,
                               Place place) {
  const AxisSensor& sensor = kAxisSensors[i];
  const std::string name = place.prefix + sensor.name, key = jump_key(place.prefix, sensor);
  Jump &jump = latest_[i], &open = open_[i];
  if (open.open && is_nearer(values.after, open.values.before, open.values.after)) {
    open.open = false;
    return place.problems.clear(
        key, fmt::format("{} jumped back to {:.6g} {}: its values from {} to {} are doubtful", name, values.after,
                         sensor.unit, utc_text(open.second), utc_text(second)));
  }
  jump.values = {open.open ? open.values.before : values.before, values.after};  // from the last trusted value
  place.problems.forget(key);                                                    // a further jump is reported, too
  begin(place, key,
        fmt::format("{} jumped from {:.6g} to {:.6g} {} at {} and stayed: a fault, or true; corrections use it", name,
                    jump.values.before, jump.values.after, sensor.unit, utc_text(jump.second)));
  open = std::move(jump);
}

void SensorChanges::seek_agreement(std::size_t i, const SecondMean& now, Place place) {
  const AxisSensor& sensor = kAxisSensors[i];
  Jump& jump = open_[i];
  const auto& sensors = sensors_of_list(now.sensor_list);
  if (now.second - jump.second > kAgreeS || jump.sensors_before.size() != sensors.size() ||
      now.sensors.size() != sensors.size())
    return;
  for (std::size_t k = 0; k < sensors.size(); ++k) {
    const double before = jump.sensors_before[k], after = now.sensors[k];
    const bool is_itself = same(before, jump.mean_before) && same(after, now.*sensor.value);
    const double part = (after - before) / (jump.values.after - jump.values.before);
    if (sensors[k].unit != sensor.unit || is_itself || !(part >= 0.5)) continue;
    jump.open = false;
    return place.problems.clear(jump_key(place.prefix, sensor),
                                fmt::format("{}the jump of {} is true: {} changed from {:.6g} to {:.6g} {}",
                                            place.prefix, sensor.name, sensors[k].name, before, after, sensor.unit));
  }
}

void SensorChanges::watch_stillness(Stillness& still, double value, const std::string& name, const std::string& unit,
                                    int least_s, Place place) {
  if (!std::isfinite(value)) return;
  const auto key = [&] { return "still " + place.prefix + name; };
  if (same(value, still.value)) {
    ++still.seconds;
    if (still.changes < kChanges || still.seconds != std::max(least_s, 10 * still.longest_s) + 1) return;
    still.open = true;
    return begin(
        place, key(),
        fmt::format("{}{} has been {:.6g} {} for {} s, and changed at least every {} s before: a fault, or true",
                    place.prefix, name, value, unit, still.seconds, still.longest_s));
  }
  if (std::exchange(still.open, false)) place.problems.clear(key(), place.prefix + name + " changes again");
  if (!std::isnan(still.value)) {
    ++still.changes;
    still.longest_s = std::max(still.longest_s, still.seconds);
  }
  still.value = value;
  still.seconds = 1;
}

void SensorChanges::forget() {
  for (Jump& jump : open_) jump = {};
  for (Stillness& still : still_) still.open = false;
}

}  // namespace prism::pipeline
