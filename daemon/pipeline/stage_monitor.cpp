// SPDX-License-Identifier: MIT
#include "daemon/pipeline/stage_monitor.hpp"

#include <fmt/format.h>

namespace prism::pipeline {
namespace {

constexpr std::uint64_t kLeastInput = 10;

std::string no_frame(const Pipeline& pipeline, std::uint64_t bytes) {
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

}  // namespace

StageCounts counts_of(const Pipeline& pipeline) {
  const wire::DecoderCounters& line = pipeline.decoder().counters();
  const drivers::ClockStatus& clock = pipeline.clock().status();
  StageCounts counts{line.bytes, line.frames, clock.duplicates, clock.samples, {}};
  for (const Axis& axis : pipeline.axes()) counts.rates.push_back(axis.rates);
  return counts;
}

std::string StageMonitor::problem_at(const Pipeline& pipeline, const StageCounts& counts, std::int64_t now_ns) {
  const std::size_t stages = 2 + counts.rates.size();
  if (since_ns_.size() != stages) {
    since_ns_.assign(stages, now_ns);
    before_.assign(stages, counts);
  }
  std::string problem;
  for (std::size_t stage = 0; stage < stages; ++stage) {
    const auto in = [stage](const StageCounts& c) { return stage == 0 ? c.bytes : stage == 1 ? c.frames : c.samples; };
    const auto out = [stage](const StageCounts& c) {
      return stage == 0 ? c.frames : stage == 1 ? c.samples : c.rates[stage - 2];
    };
    const StageCounts& before = before_[stage];
    const std::uint64_t input = in(counts)-in(before);
    if (out(counts) != out(before) || input == 0) {
      since_ns_[stage] = now_ns;
      before_[stage] = counts;
      continue;
    }
    if (!problem.empty() || input < kLeastInput || static_cast<double>(now_ns - since_ns_[stage]) < 1e9 * kStarvedS)
      continue;
    problem = stage == 0   ? no_frame(pipeline, input)
              : stage == 1 ? no_sample(input, counts.repeated - before.repeated)
                           : no_rate(pipeline, stage - 2, input);
  }
  return problem;
}

std::optional<StageMonitor::Notice> StageMonitor::push(const Pipeline& pipeline, std::int64_t now_ns) {
  const std::string found = problem_at(pipeline, counts_of(pipeline), now_ns);
  if (found.empty() == problem_.empty()) {
    if (!found.empty()) problem_ = found;  // with the current numbers
    return std::nullopt;
  }
  problem_ = found;
  if (found.empty()) return Notice{false, "the gyro's data give rates again"};
  return Notice{true, found};
}

}  // namespace prism::pipeline
