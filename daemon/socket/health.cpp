// SPDX-License-Identifier: MIT
#include "daemon/socket/health.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/text_number.hpp"
#include "daemon/socket/answer_json.hpp"
#include "daemon/socket/answers.hpp"
#include "daemon/socket/line_answers.hpp"

namespace prism::socket {
namespace {

using Level = Health::Level;

constexpr std::uint32_t kUnusable = compensation::kRateInvalid | compensation::kInputMissing |
                                    compensation::kOverLimit | compensation::kNoData | compensation::kImplausible |
                                    compensation::kClocksDiffer;

class Findings {
 public:
  void add(Level level, std::string text) {
    if (text.empty()) return;
    health_.level = std::max(health_.level, level);
    auto& problems = health_.problems;
    problems.insert(level == Level::kFailed ? problems.begin() + failures_++ : problems.end(), std::move(text));
  }
  Health result() && { return std::move(health_); }

 private:
  Health health_;
  std::ptrdiff_t failures_ = 0;
};

// "log: cannot write (No space left on device) since 12:03:10 UTC, 240 rows lost"
std::string write_problem(const std::string& what, const std::optional<pipeline::WriteError>& error, const char* unit) {
  if (!error) return {};
  return fmt::format("{}: cannot write ({}) since {}, {} {} lost", what, error->why, utc_text(error->since_s),
                     error->lost, unit);
}

// An instrument that sends, but nothing that its description or columns can read.
std::string unread_problem(const Sources& sources, std::size_t i) {
  const pipeline::Setup::SensorLine& line = sources.acquisition.setup().sensor_lines[i];
  const pipeline::SensorFeed& feed = sources.acquisition.pipeline().sensor_feeds()[i];
  const std::int64_t since_ns = std::max(sources.acquisition.line(i + 1).since_ns, feed.last_ns().value_or(0));
  const double waited_s = seconds(time_of(sources) - since_ns);
  if (waited_s <= line.stale_after_s || feed.decoder().counters().bytes == 0) return {};
  return fmt::format("{}: bytes, but no value that can be used for {:.0f} s: wrong description, columns or settings",
                     line.name, waited_s);
}

void add_lines(Findings& found, const Sources& sources) {
  const pipeline::Acquisition& acquisition = sources.acquisition;
  for (std::size_t i = 0; i < acquisition.lines(); ++i) {
    const pipeline::LineStatus& line = acquisition.line(i);
    const std::string name = i == 0 ? "line" : acquisition.setup().sensor_lines[i - 1].name;
    if (!line.turned_away.empty()) found.add(Level::kCaution, fmt::format("{}: {}", name, line.turned_away));
    if (line.delivers()) {
      if (i > 0) found.add(Level::kCaution, unread_problem(sources, i - 1));
      continue;
    }
    found.add(i == 0 ? Level::kFailed : Level::kCaution,
              fmt::format("{}: {}{}{}", name, state_name(line.state), line.detail.empty() ? "" : ": ", line.detail));
  }
}

void add_axis(Findings& found, const Sources& sources, std::size_t axis) {
  const pipeline::Acquisition& acquisition = sources.acquisition;
  const std::string prefix = acquisition.axis_prefix(axis), &model = acquisition.setup().axes[axis].model_problem;
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

const char* health_name(Level level) {
  return level == Level::kGood ? "good" : level == Level::kCaution ? "caution" : "failed";
}

Health health_of(const Sources& sources) {
  const pipeline::Acquisition& acquisition = sources.acquisition;
  Findings found;
  add_lines(found, sources);
  const std::string& starved = acquisition.starved();
  found.add(Level::kFailed,
            starved.empty() && has_no_frames(sources) ? "line: bytes, but no frame that can be used" : starved);
  found.add(Level::kFailed, acquisition.clocks_problem());
  found.add(Level::kFailed, acquisition.disk_problem());
  for (std::size_t i = 0; i < acquisition.axes(); ++i) {
    add_axis(found, sources, i);
    for (std::string& change : acquisition.record(i).changes()) found.add(Level::kCaution, std::move(change));
    if (const auto* const log = acquisition.record(i).log())
      found.add(Level::kFailed, write_problem(acquisition.axis_prefix(i) + "log", log->write_error(), "rows"));
  }
  for (std::size_t i = 0; i < acquisition.lines(); ++i) {
    if (const auto* const capture = acquisition.capture(i))
      found.add(Level::kFailed, write_problem("capture", capture->write_error(), "bytes"));
  }
  return std::move(found).result();
}

}  // namespace prism::socket
