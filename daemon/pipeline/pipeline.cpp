// SPDX-License-Identifier: MIT
#include "daemon/pipeline/pipeline.hpp"

#include <cassert>
#include <optional>
#include <utility>

namespace prism::pipeline {

Pipeline::Pipeline(const Setup& setup) : decoder_(setup.frames), clock_(setup.frames, setup.clock) {
  for (std::size_t i = 0; i < setup.axes.size(); ++i)
    axes_.push_back({setup.frames->axes[i].name, compensation::Engine(setup.axes[i].engine, setup.sensors)});
  std::vector<std::string> names;
  for (const Axis& axis : axes_) names.push_back(axis.name);
  rows_.axes = std::make_shared<const std::vector<std::string>>(std::move(names));
  [[maybe_unused]] const auto taken = use_models(setup);
  assert(taken);  // load_setup tried it
}

const Rows& Pipeline::begin_session(std::int64_t now_ns) {
  finish();
  decoder_.reset();
  clock_.reset();
  begin_axes(now_ns);
  return rows_;
}

const Rows& Pipeline::feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  rows_.clear();
  readings_.clear();
  if (!session_ns_) begin_axes(arrival_ns);
  decoder_.feed(bytes, arrival_ns, readings_);
  return pass();
}

const Rows& Pipeline::expire(std::int64_t now_ns) {
  rows_.clear();
  readings_.clear();
  decoder_.expire(now_ns, readings_);
  return pass();
}

const Rows& Pipeline::finish() {
  rows_.clear();
  readings_.clear();
  decoder_.finish(readings_);
  pass();
  end_axes();
  return rows_;
}

// On copies first: of several axes all take theirs, or none.
Result<void> Pipeline::use_models(const Setup& setup) {
  std::vector<Axis> axes = axes_;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (auto used = axes[i].engine.use(setup.axes[i].model, setup.axes[i].fallback); !used) return used;
  }
  axes_ = std::move(axes);
  return {};
}

void Pipeline::begin_axes(std::int64_t now_ns) {
  session_ns_ = now_ns;
  last_second_.reset();
  for (Axis& axis : axes_) axis.engine.reset();
}

void Pipeline::end_axes() {
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (const auto row = axes_[i].engine.finish())
      rows_.windows.push_back({i, rows_.samples.size(), *session_ns_, *row});
  }
}

const Rows& Pipeline::pass() {
  for (const wire::Reading& reading : readings_) {
    if (!clock_.push(reading)) continue;
    const std::size_t before = rows_.samples.size();
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      const std::optional<Sample> sample = clock_.sample(reading, i);
      if (!sample) continue;
      const std::int64_t second = compensation::bucket_second(sample->time_ns);
      if (last_second_ && second < *last_second_) {
        end_axes();
        begin_axes(reading.arrival_ns);
      }
      last_second_ = second;
      Rows::Sample made{i, {}};
      if (const auto window = axes_[i].engine.push(*sample, made.row, reading.sensors)) {
        rows_.windows.push_back({i, before, *session_ns_, *window});
      }
      rows_.samples.push_back(made);
    }
  }
  return rows_;
}

}  // namespace prism::pipeline
