// SPDX-License-Identifier: MIT
#include "daemon/pipeline/sensor_feed.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/text_number.hpp"

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

namespace {

using compensation::SecondMean;

// Means of the same number in another number of samples differ by rounding.
bool same(double a, double b) { return std::fabs(a - b) <= 1e-12 * std::fabs(a); }

bool is_nearer(double value, double to, double than) { return std::fabs(value - to) < std::fabs(value - than); }

std::string jump_key(const std::string& prefix, const AxisSensor& sensor) { return "jump " + prefix + sensor.name; }

void begin(Problems& problems, const std::string& key, std::string text) {
  problems.set(key, {.kind = "question", .text = std::move(text)});
}

}  // namespace

void SensorChanges::push(const compensation::CompensatedWindow& row, const std::string& prefix, Problems& problems) {
  const Place place{prefix, problems};
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
  begin(place.problems, key,
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
    return begin(place.problems, key(),
                 fmt::format("{}{} is {:.6g} {} since {} s, and changed at least every {} s before: a fault, or true",
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
