// SPDX-License-Identifier: MIT
#include "daemon/pipeline/stage_monitor.hpp"

#include <fmt/format.h>

#include "drivers/wire/decode/sniffer.hpp"

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

}  // namespace

StageCounts counts_of(const Pipeline& pipeline) {
  const wire::DecoderCounters& line = pipeline.decoder().counters();
  const drivers::ClockStatus& clock = pipeline.clock().status();
  StageCounts counts{line.bytes, line.frames, line.refused, line.unconfirmed, clock.duplicates, clock.samples, {}};
  for (const Axis& axis : pipeline.axes()) counts.rates.push_back(axis.rates);
  return counts;
}

std::string StageMonitor::push(const Pipeline& pipeline, std::int64_t now_ns) {
  const StageCounts counts = counts_of(pipeline);
  if (stages_.empty()) stages_.assign(2 + counts.rates.size(), {now_ns, counts});
  std::string problem;
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    const auto in = [i](const StageCounts& c) { return i == 0 ? c.bytes : i == 1 ? c.frames : c.samples; };
    const auto out = [i](const StageCounts& c) { return i == 0 ? c.frames : i == 1 ? c.samples : c.rates[i - 2]; };
    Stage& stage = stages_[i];
    const std::uint64_t input = in(counts)-in(stage.before);
    if (out(counts) != out(stage.before) || input == 0) {
      stage = {now_ns, counts};
      continue;
    }
    const bool starved = input >= kLeastInput && static_cast<double>(now_ns - stage.since_ns) >= 1e9 * kStarvedS;
    if (!starved || !problem.empty()) continue;
    problem =
        i == 0   ? no_frame(pipeline, input, counts.refused - stage.before.refused, counts.single - stage.before.single)
        : i == 1 ? no_sample(input, counts.repeated - stage.before.repeated)
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

}  // namespace prism::pipeline
