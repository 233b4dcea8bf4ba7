// SPDX-License-Identifier: MIT
#include "daemon/funnel.hpp"

#include <fmt/format.h>

namespace prism::daemon {
namespace {

std::string row(const std::string& stage, std::uint64_t count, const std::string& remark = "") {
  return fmt::format("{:<12}{:>12}{}{}\n", stage, count, remark.empty() ? "" : "   ", remark);
}

// "3 failed their check, 12 missing"; counts of 0 are left out.
std::string losses(std::initializer_list<std::pair<std::uint64_t, const char*>> counts) {
  std::string text;
  for (const auto& [count, what] : counts) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, what);
  }
  return text;
}

}  // namespace

std::string funnel_text(const pipeline::Device& device) {
  const pipeline::Pipeline& pipeline = *device.pipeline;
  const wire::DecoderCounters& line = pipeline.decoder().counters();
  const drivers::ClockStatus& clock = pipeline.clock().status();
  std::string text = row("bytes", line.bytes, losses({{line.skipped_bytes, "in no frame"}}));
  text += row("frames", line.frames,
              losses({{line.bad_check, "failed their check"},
                      {clock.missing_frames, "missing"},
                      {clock.rejected_counters, "with a wrong counter"}}));
  text += row("samples", clock.samples, losses({{clock.duplicates, "repeat the counter or time of the frame before"}}));
  for (std::size_t i = 0; i < device.axes.size(); ++i) {
    const std::string axis = device.axes.size() > 1 ? " " + device.axes[i].name : "";
    const pipeline::AxisRecord& rows = device.axes[i];
    text += row("rates" + axis, pipeline.axes()[i].rates);
    text += row("seconds" + axis, rows.seconds);
    text += row("windows" + axis, rows.windows, fmt::format("of {} s", device.setup.axes[i].features().length_s));
    text += row("corrected" + axis, rows.corrected, device.setup.axes[i].model ? "" : "no model");
  }
  return text;
}

}  // namespace prism::daemon
