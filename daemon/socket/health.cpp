// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "daemon/socket/answers.hpp"

namespace prism::socket {
namespace {

using Level = Problem::Level;

constexpr std::uint32_t kUnusable = compensation::kRateInvalid | compensation::kInputMissing |
                                    compensation::kOverLimit | compensation::kNoData | compensation::kImplausible |
                                    compensation::kClocksDiffer;

struct Findings {
  std::vector<std::string> failed, cautions;

  void add(Level level, std::string text) {
    if (!text.empty()) (level == Level::kFailed ? failed : cautions).push_back(std::move(text));
  }
};

// An instrument that sends, but nothing that its description or columns can read.
std::string unread_problem(const Sources& sources, std::size_t i) {
  const pipeline::Setup::SensorLine& line = sources.device.setup.sensor_lines[i];
  const pipeline::SensorFeed& feed = sources.device.pipeline->sensor_feeds()[i];
  const std::int64_t since_ns = std::max(sources.device.lines[i + 1].since_ns, feed.last_ns().value_or(0));
  const double waited_s = seconds(time_of(sources) - since_ns);
  if (waited_s <= line.stale_after_s || feed.decoder().counters().bytes == 0) return {};
  return fmt::format("{}: bytes, but no value that can be used for {:.0f} s: wrong description, columns or settings",
                     line.name, waited_s);
}

void add_lines(Findings& found, const Sources& sources) {
  const pipeline::Device& device = sources.device;
  for (std::size_t i = 0; i < device.lines.size(); ++i) {
    const pipeline::LineStatus& line = device.lines[i];
    const std::string name = i == 0 ? "line" : device.setup.sensor_lines[i - 1].name;
    if (line.delivers()) {
      if (i > 0) found.add(Level::kCaution, unread_problem(sources, i - 1));
      continue;
    }
    found.add(i == 0 ? Level::kFailed : Level::kCaution,
              fmt::format("{}: {}{}{}", name, state_name(line.state), line.detail.empty() ? "" : ": ", line.detail));
  }
}

void add_axis(Findings& found, const Sources& sources, std::size_t axis) {
  const pipeline::Device& device = sources.device;
  const std::string prefix = device.axes[axis].prefix, &model = device.setup.axes[axis].model_problem;
  if (!model.empty()) found.add(Level::kFailed, fmt::format("{}model: {}", prefix, model));
  std::uint32_t quality = current_quality(sources, axis) & ~compensation::kNoData;  // the line's problem
  if (quality & compensation::kNoModel) {
    if (model.empty()) found.add(Level::kCaution, prefix + "no model is configured: rates are uncorrected");
    quality &= ~compensation::kNoModel;
  }
  if (quality == compensation::kGood) return;
  found.add(quality & kUnusable ? Level::kFailed : Level::kCaution,
            fmt::format("{}quality: {}", prefix, compensation::quality_text(quality)));
}

}  // namespace

nlohmann::ordered_json health_json(const Sources& sources) {
  const pipeline::Device& device = sources.device;
  Findings found;
  add_lines(found, sources);
  if (has_no_frames(sources) && !device.problems.has(pipeline::kNoRate))
    found.add(Level::kFailed, "line: bytes, but no frame that can be used");
  for (std::size_t i = 0; i < device.axes.size(); ++i) add_axis(found, sources, i);
  for (const Problem& problem : device.problems.list()) {
    if (!problem.kind.starts_with("line_") || problem.kind == "line_peer") found.add(problem.level, problem.shown());
  }
  const char* const state = !found.failed.empty() ? "failed" : found.cautions.empty() ? "good" : "caution";
  found.failed.insert(found.failed.end(), found.cautions.begin(), found.cautions.end());
  return {{"state", state}, {"problems", found.failed}};
}

}  // namespace prism::socket
