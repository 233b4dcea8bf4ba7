// SPDX-License-Identifier: MIT
#include "daemon/pipeline/pipeline.hpp"

#include <cassert>
#include <optional>

namespace prism::pipeline {

Pipeline::Pipeline(const Setup& setup)
    : decoder_(setup.frames),
      clock_(setup.frames, setup.clock),
      axes_{{setup.frames->gyro.axis, compensation::Engine(setup.config.engine)}} {
  [[maybe_unused]] const auto taken = use_models(setup);
  assert(taken);  // load_setup tried it
}

const Rows& Pipeline::begin_session() {
  finish();
  decoder_.reset();
  clock_.reset();
  for (Axis& axis : axes_) axis.engine.reset();
  return rows_;
}

const Rows& Pipeline::feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  rows_.clear();
  readings_.clear();
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
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (const auto row = axes_[i].engine.finish()) rows_.windows.push_back({i, rows_.samples.size(), *row});
  }
  return rows_;
}

Result<void> Pipeline::use_models(const Setup& setup) { return axes_.front().engine.use(setup.model, setup.fallback); }

const Rows& Pipeline::pass() {
  for (const wire::Reading& reading : readings_) {
    const std::optional<Sample> sample = clock_.push(reading);
    if (!sample) continue;
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      Rows::Sample made{i, {}};
      if (const auto window = axes_[i].engine.push(*sample, made.row)) {
        rows_.windows.push_back({i, rows_.samples.size(), *window});
      }
      rows_.samples.push_back(made);
    }
  }
  return rows_;
}

}  // namespace prism::pipeline
