// SPDX-License-Identifier: MIT
#include "daemon/pipeline/pipeline.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

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

Pipeline::Pipeline(const Setup& setup) : decoder_(setup.frames), clock_(setup.frames, setup.clock) {
  for (std::size_t i = 0; i < setup.axes.size(); ++i) {
    axes_.push_back({.name = setup.frames->axes[i].name,
                     .engine = compensation::CompensationEngine(setup.axes[i].engine, setup.sensors),
                     .thermometer = setup.axes[i].thermometer,
                     .uhfo = setup.axes[i].uhfo});
  }
  for (const Setup::SensorLine& line : setup.sensor_lines) feeds_.emplace_back(line);
  values_.assign(sensors_of_list(setup.sensors).size(), kUnknown);
  stride_ = wire::sensor_stride(setup.frames->counted_rate_hz());
  std::vector<std::string> names;
  for (const Axis& axis : axes_) names.push_back(axis.name);
  rows_.axes = std::make_shared<const std::vector<std::string>>(std::move(names));
  [[maybe_unused]] const auto taken = use_models(setup);
  assert(taken);  // load_setup tried it
}

Rows& Pipeline::begin_session(std::int64_t now_ns) {
  finish();
  decoder_.reset();
  clock_.reset();
  begin_axes(now_ns);
  return rows_;
}

Rows& Pipeline::feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  rows_.clear();
  readings_.clear();
  if (!session_ns_) begin_axes(arrival_ns);
  last_arrival_ns_ = arrival_ns;
  decoder_.feed(bytes, arrival_ns, readings_);
  return pass();
}

Rows& Pipeline::expire(std::int64_t now_ns) {
  rows_.clear();
  readings_.clear();
  decoder_.expire(now_ns, readings_);
  return pass();
}

Rows& Pipeline::finish() {
  rows_.clear();
  readings_.clear();
  decoder_.finish(readings_);
  pass();
  if (const auto held = clock_.take_held()) handle(*held);
  end_axes();
  return rows_;
}

// Values since the gyro's last bytes apply from its next bytes on: only the latest is needed.
void Pipeline::feed_sensors(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  feeds_[line].feed(bytes, arrival_ns, decoder_.held_since_ns().value_or(arrival_ns), last_arrival_ns_);
}

std::vector<double> Pipeline::sensors_now(std::int64_t now_ns) const {
  std::vector<double> values = values_;
  std::size_t at = values.size();
  for (auto feed = feeds_.rbegin(); feed != feeds_.rend(); ++feed) {
    at -= feed->sensors();
    feed->values_at(now_ns, std::span(values).subspan(at, feed->sensors()));
  }
  return values;
}

// Works on copies first, so that either all axes change or none.
Result<void> Pipeline::use_models(const Setup& setup) {
  std::vector<Axis> axes = axes_;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (auto used = axes[i].engine.use(setup.axes[i].model, setup.axes[i].fallback); !used) return used;
  }
  axes_ = std::move(axes);
  keeps_frames_ = !setup.outputs.empty();
  return {};
}

void Pipeline::begin_axes(std::int64_t now_ns) {
  session_ns_ = now_ns;
  last_second_.reset();
  waiting_ = 0;
  for (Axis& axis : axes_) axis.engine.reset();
}

void Pipeline::end_axes() {
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (const auto row = axes_[i].engine.finish()) close_second(i, rows_.samples.size(), *row);
  }
}

// Returns values for every stride_-th frame only: at 1000 frames per second, not every frame needs them.
std::span<const double> Pipeline::sensors_at(const wire::DecodedMessage& reading) {
  if (values_.empty()) return {};
  const std::size_t own = decoder_.description().sensors().size();
  std::copy_n(reading.sensors.begin(), own, values_.begin());
  std::size_t at = own;
  for (const SensorFeed& feed : feeds_) {
    feed.values_at(decoder_.chunk_arrival_ns(reading), std::span(values_).subspan(at, feed.sensors()));
    at += feed.sensors();
  }
  const bool turn = own > 0 ? reading.sensors_read : waiting_ == 0;
  waiting_ = waiting_ == 0 ? stride_ - 1 : waiting_ - 1;
  return turn ? std::span<const double>(values_) : std::span<const double>();
}

void Pipeline::close_second(std::size_t axis, std::size_t samples_before, const compensation::CompensatedWindow& row) {
  rows_.windows.push_back({axis, samples_before, *session_ns_, row});
  rows_.windows.back().row.window.second_mean.arrival_ns = axes_[axis].last_ns;
}

void Pipeline::enter_second(const Sample& sample, std::int64_t arrival_ns) {
  const std::int64_t second = compensation::second_number(sample.time_ns);
  if (last_second_ && second < *last_second_) {
    end_axes();
    begin_axes(arrival_ns);
  }
  last_second_ = second;
}

Rows& Pipeline::pass() {
  for (const wire::DecodedMessage& reading : readings_) {
    std::size_t first = 0, count = 0;
    clock_.check_counter(reading, [&](const wire::DecodedMessage& passed) {
      first = rows_.samples.size();
      handle(passed);
      count = passed.offset == reading.offset ? rows_.samples.size() - first : 0;
    });
    if (keeps_frames_ && reading.has_gyro) rows_.frames.push_back({reading, first, count});
  }
  return rows_;
}

void Pipeline::handle(const wire::DecodedMessage& reading) {
  const bool measured = clock_.push(reading);
  if (clock_.began_session()) {
    end_axes();
    begin_axes(reading.arrival_ns);
  }
  if (!measured) return;
  const std::span<const double> sensors = sensors_at(reading);
  const std::size_t before = rows_.samples.size();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    std::optional<Sample> sample = clock_.sample(reading, i);
    if (!sample) continue;
    if (axes_[i].thermometer >= 0) {
      sample->temperature_degc = values_[static_cast<std::size_t>(axes_[i].thermometer)];
      sample->out_of_bounds.temperature = false;
    }
    if (axes_[i].uhfo >= 0) {
      sample->uhfo_v = values_[static_cast<std::size_t>(axes_[i].uhfo)];
      sample->out_of_bounds.uhfo = false;
    }
    if (rows_.samples.size() == before) enter_second(*sample, reading.arrival_ns);  // the same for all axes
    Rows::Sample& made = rows_.samples.emplace_back();
    made.axis = i;
    if (const auto window = axes_[i].engine.push(*sample, made.row, sensors)) close_second(i, before, *window);
    axes_[i].last_ns = reading.arrival_ns;
    axes_[i].rates += !std::isnan(sample->rate_deg_per_h);
  }
}

std::int64_t Pipeline::last_frame_ns() const {
  std::int64_t last_ns = 0;
  for (const Axis& axis : axes_) last_ns = std::max(last_ns, axis.last_ns);
  return last_ns;
}

}  // namespace prism::pipeline
