// SPDX-License-Identifier: MIT
#include "daemon/pipeline/sensor_changes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/text_number.hpp"

namespace prism::pipeline {
namespace {

using compensation::SecondMean;

// Means of the same number in another number of samples differ by rounding.
bool same(double a, double b) { return std::fabs(a - b) <= 1e-12 * std::fabs(a); }

bool is_nearer(double value, double to, double than) { return std::fabs(value - to) < std::fabs(value - than); }

void end(std::string& change, std::string text, std::vector<Notice>& notices) {
  change.clear();
  notices.push_back({false, std::move(text)});
}

}  // namespace

std::vector<Notice> SensorChanges::push(const compensation::CompensatedWindow& row) {
  std::vector<Notice> notices;
  const SecondMean& now = row.window.second_mean;
  const auto& sensors = sensors_of_list(now.sensor_list);
  still_.resize(kAxisSensors.size() + sensors.size());
  for (std::size_t i = 0; i < kAxisSensors.size(); ++i) {
    const AxisSensor& sensor = kAxisSensors[i];
    watch_jump(i, row, notices);
    if (!open_[i].text.empty()) seek_agreement(i, now, notices);
    if (now.implausible.*sensor.in_set || !std::isfinite(now.*sensor.value)) continue;
    last_[i] = now.*sensor.value;
    watch_stillness(still_[i], last_[i], sensor.name, sensor.unit, i == 0 ? kStillRateS : kStillS, notices);
  }
  if (now.sensors.size() != sensors.size()) return notices;
  last_sensors_ = now.sensors;
  for (std::size_t k = 0; k < sensors.size(); ++k)
    watch_stillness(still_[kAxisSensors.size() + k], now.sensors[k], sensors[k].name.c_str(), sensors[k].unit.c_str(),
                    kStillS, notices);
  return notices;
}

void SensorChanges::watch_jump(std::size_t i, const compensation::CompensatedWindow& row,
                               std::vector<Notice>& notices) {
  const AxisSensor& sensor = kAxisSensors[i];
  const SecondMean& now = row.window.second_mean;
  if (now.implausible.*sensor.in_set) {
    const bool was_rejecting = watch_[i].is_rejecting();
    watch_[i].reject(row.rejections.*sensor.rejection);
    if (!was_rejecting && watch_[i].is_rejecting()) latest_[i] = {{}, now.second, {}, last_[i], last_sensors_};
  } else if (std::isfinite(now.*sensor.value)) {
    if (const auto jump = watch_[i].accept(now.*sensor.value)) begin_jump(i, *jump, now.second, notices);
  }
}

// It stayed, or it ends an earlier jump.
void SensorChanges::begin_jump(std::size_t i, const compensation::JumpWatch::Jump& values, std::int64_t second,
                               std::vector<Notice>& notices) {
  const AxisSensor& sensor = kAxisSensors[i];
  Jump &jump = latest_[i], &open = open_[i];
  const bool was_open = !open.text.empty();
  if (was_open && is_nearer(values.after, open.values.before, open.values.after)) {
    return end(open.text,
               fmt::format("{} jumped back to {:.6g} {}: its values from {} to {} are doubtful", sensor.name,
                           values.after, sensor.unit, utc_text(open.second), utc_text(second)),
               notices);
  }
  jump.values = {was_open ? open.values.before : values.before, values.after};  // from the last trusted value
  jump.text = fmt::format("{} jumped from {:.6g} to {:.6g} {} at {} and stayed: a fault, or true; corrections use it",
                          sensor.name, jump.values.before, jump.values.after, sensor.unit, utc_text(jump.second));
  open = std::move(jump);
  notices.push_back({true, open.text});
}

void SensorChanges::seek_agreement(std::size_t i, const SecondMean& now, std::vector<Notice>& notices) {
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
    return end(jump.text,
               fmt::format("the jump of {} is true: {} changed from {:.6g} to {:.6g} {}", sensor.name, sensors[k].name,
                           before, after, sensor.unit),
               notices);
  }
}

void SensorChanges::watch_stillness(Stillness& still, double value, const char* name, const char* unit, int least_s,
                                    std::vector<Notice>& notices) {
  if (!std::isfinite(value)) return;
  if (same(value, still.value)) {
    ++still.seconds;
    if (still.changes < kChanges || still.seconds != std::max(least_s, 10 * still.longest_s) + 1) return;
    still.text = fmt::format("{} is {:.6g} {} since {} s, and changed at least every {} s before: a fault, or true",
                             name, value, unit, still.seconds, still.longest_s);
    notices.push_back({true, still.text});
    return;
  }
  if (!still.text.empty()) end(still.text, fmt::format("{} changes again", name), notices);
  if (!std::isnan(still.value)) {
    ++still.changes;
    still.longest_s = std::max(still.longest_s, still.seconds);
  }
  still.value = value;
  still.seconds = 1;
}

std::vector<std::string> SensorChanges::open() const {
  std::vector<std::string> texts;
  for (const Jump& jump : open_) {
    if (!jump.text.empty()) texts.push_back(jump.text);
  }
  for (const Stillness& still : still_) {
    if (!still.text.empty()) texts.push_back(still.text);
  }
  return texts;
}

std::vector<std::string> SensorChanges::end_all() {
  std::vector<std::string> texts = open();
  for (Jump& jump : open_) jump = {};
  for (Stillness& still : still_) still.text.clear();
  return texts;
}

}  // namespace prism::pipeline
