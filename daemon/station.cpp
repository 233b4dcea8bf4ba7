// SPDX-License-Identifier: MIT
#include "daemon/station.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

namespace prism::daemon {
namespace {

void to_log(const Event& event) {
  const auto level = event.severity == Severity::kError     ? spdlog::level::err
                     : event.severity == Severity::kWarning ? spdlog::level::warn
                     : event.severity == Severity::kInfo    ? spdlog::level::info
                                                            : spdlog::level::debug;
  if (event.repeats > 0) {
    spdlog::log(level, "{} ({} more times since it was last said)", event.text, event.repeats);
  } else {
    spdlog::log(level, "{}", event.text);
  }
}

}  // namespace

std::int64_t host_time_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

Station::Station(Setup setup, std::unique_ptr<RowWriter> rows)
    : setup_(std::move(setup)),
      rows_(std::move(rows)),
      pipeline_(std::make_unique<Pipeline>(setup_, *this)),
      events_([this](const Event& event) {
        to_log(event);
        publisher.event(event_json(event));
      }),
      state_since_ns_(host_time_ns()),
      started_ns_(state_since_ns_) {}

void Station::begin_session(std::int64_t now_ns) {
  if (recorder) recorder->mark_opened(now_ns);
  pipeline_->begin_session();
  publisher.flush();
  ++sessions_;
}

[[gnu::hot]] void Station::feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  if (recorder) recorder->data(bytes, arrival_ns);
  pipeline_->feed(bytes, arrival_ns);
  publisher.flush();
}

void Station::expire(std::int64_t now_ns) {
  pipeline_->expire(now_ns);
  publisher.flush();
}

void Station::finish() {
  pipeline_->finish();
  publisher.flush();
  if (recorder) recorder->flush();
}

void Station::sync() {
  if (rows_) rows_->sync();
  if (recorder) recorder->flush();
}

void Station::set_state(LineState state, const std::string& detail) {
  if (state != state_) state_since_ns_ = host_time_ns();
  state_ = state;
  state_detail_ = detail;
}

void Station::tell(Severity severity, const std::string& kind, const std::string& text) {
  events_.add(severity, kind, text, host_time_ns());
}

void Station::line_hardware(const std::optional<drivers::LineCounters>& counters) {
  const auto errors = [](const drivers::LineCounters& c) {
    return c.framing_errors + c.parity_errors + c.overruns + c.breaks + c.buffer_overruns;
  };
  if (counters && hardware_ && errors(*counters) > errors(*hardware_)) {
    tell(Severity::kWarning, "line_errors",
         "the serial hardware reports errors on the line; prismctl line counts them");
  }
  hardware_ = counters;
}

[[gnu::hot]] void Station::sample(const compensation::Compensated& row) {
  last_ = row;
  has_last_ = true;
  if (publisher.wants_samples()) publisher.sample(row);
}

void Station::window(const compensation::CompensatedWindow& row) {
  constexpr std::size_t kHistorySeconds = 3600;
  if (rows_) rows_->append(row);
  stability_.add(row, pipeline_->engine().model() ? pipeline_->engine().model()->info().features.length_s : 100);
  history_.push_back(row);
  if (history_.size() > kHistorySeconds) history_.pop_front();
  watch_quality(row);
  publisher.window(row);
}

// A change of quality is an event; a flood of rows with the same fault is not.
void Station::watch_quality(const compensation::CompensatedWindow& row) {
  const std::uint32_t quality = row.correction.quality;
  if (quality == last_quality_) return;
  last_quality_ = quality;
  if (state_ == LineState::kReplaying) return;
  const bool harmless =
      quality == compensation::kGood || quality == compensation::kWarming || quality == compensation::kNoModel;
  tell(harmless ? Severity::kInfo : Severity::kWarning, "quality",
       "quality is now " + compensation::quality_text(quality));
}

Result<bool> Station::reconfigure(Setup setup) {
  const config::Config& before = setup_.config;
  const config::Config& after = setup.config;
  if (after.socket.path != before.socket.path || after.name != before.name) {
    return refuse(after.path, "name or socket/path changed, expected as before: that needs a restart of prismd");
  }
  const auto directory = [](const std::optional<config::SegmentSettings>& s) {
    return s ? s->directory : std::string();
  };
  if (directory(after.log) != directory(before.log) || directory(after.capture) != directory(before.capture)) {
    return refuse(after.path, "log or capture folder changed, expected as before: that needs a restart of prismd");
  }
  const bool same_stream =
      setup.frames->id == setup_.frames->id && setup.frames->gyro.axis == setup_.frames->gyro.axis &&
      setup.frames->gyro.scale == setup_.frames->gyro.scale && setup.clock.source == setup_.clock.source;
  const bool same_line = same_stream && setup.line == setup_.line;
  const bool same_engine = after.engine.max_bias_deg_per_h == before.engine.max_bias_deg_per_h;
  if (same_stream && same_engine) {
    if (auto used = pipeline_->use(setup.model, setup.fallback); !used) return tl::unexpected<Error>(used.error());
  } else {
    bytes_before_ = bytes_received();
    frames_before_ = frames();
    pipeline_->finish();
    pipeline_ = std::make_unique<Pipeline>(setup, *this);
  }
  setup_ = std::move(setup);
  stability_.reset();  // figures of two models do not mix
  if (rows_) rows_->set_metadata(log_metadata(setup_));
  return !same_line;
}

std::string Station::summary() const {
  const auto& correction = pipeline_->engine().correction();
  const std::string device = setup_.config.line.device.empty() ? "no line" : setup_.config.line.device;
  switch (state_) {
    case LineState::kReceiving:
      return fmt::format("receiving from {}, {} frames, quality {}", device, frames(),
                         compensation::quality_text(correction.quality));
    case LineState::kReplaying:
      return fmt::format("replaying, {} frames", frames());
    default:
      return fmt::format("{}: {}", device, state_detail_.empty() ? "waiting" : state_detail_);
  }
}

}  // namespace prism::daemon
