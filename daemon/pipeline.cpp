// SPDX-License-Identifier: MIT
#include "daemon/pipeline.hpp"

#include <cassert>
#include <utility>

namespace prism::daemon {

Pipeline::Pipeline(const Setup& setup, RowSink& sink)
    : decoder_(setup.frames), clock_(setup.frames, setup.clock), engine_(setup.config.engine), sink_(sink) {
  [[maybe_unused]] const auto taken = engine_.use(setup.model, setup.fallback);
  assert(taken);  // load_setup tried it
}

void Pipeline::begin_session() {
  finish();
  decoder_.reset();
  clock_.reset();
  engine_.reset();
}

[[gnu::hot]] void Pipeline::feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  readings_.clear();
  decoder_.feed(bytes, arrival_ns, readings_);
  pass(readings_);
}

void Pipeline::expire(std::int64_t now_ns) {
  readings_.clear();
  decoder_.expire(now_ns, readings_);
  pass(readings_);
}

void Pipeline::finish() {
  readings_.clear();
  decoder_.finish(readings_);
  pass(readings_);
  if (const auto row = engine_.finish()) sink_.window(*row);
}

[[gnu::hot]] void Pipeline::pass(const std::vector<wire::Reading>& readings) {
  compensation::Compensated row;
  for (const wire::Reading& reading : readings) {
    const std::optional<Sample> sample = clock_.push(reading);
    if (!sample) continue;
    const auto window = engine_.push(*sample, row);
    if (window) sink_.window(*window);
    sink_.sample(row);
  }
}

}  // namespace prism::daemon
