// SPDX-License-Identifier: MIT
#include "daemon/pipeline/acquisition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace prism::pipeline {
namespace {

// Returns an error if a reload changes a socket or a directory, which other programs use.
Result<void> same_places(const Setup& before_setup, const Setup& after_setup) {
  const config::Config &before = before_setup.config, &after = after_setup.config;
  if (after.socket.path != before.socket.path || after.name != before.name) {
    return make_error(after.path, "name or socket/path changed; restart prismd to apply it");
  }
  const auto directory = [](const std::optional<config::LogSegmentSettings>& s) {
    return s ? s->directory : std::string();
  };
  if (directory(after.log) != directory(before.log) || directory(after.capture) != directory(before.capture)) {
    return make_error(after.path, "log or capture directory changed; restart prismd to apply it");
  }
  return {};
}

bool same_stream(const Setup& a, const Setup& b) {
  const auto same_axis = [](const wire::AxisRule& one, const wire::AxisRule& other) {
    return one.name == other.name && one.scale == other.scale && one.thermometer == other.thermometer;
  };
  const auto same_line = [](const Setup::SensorLine& one, const Setup::SensorLine& other) {
    return one.name == other.name && one.frames->id == other.frames->id && one.stale_after_s == other.stale_after_s;
  };
  const auto same_source = [](const auto& one, const auto& other) {
    return one.thermometer == other.thermometer && one.uhfo == other.uhfo;
  };
  return a.frames->id == b.frames->id && a.clock.source == b.clock.source &&
         a.clock.check_frame_rate == b.clock.check_frame_rate &&
         sensors_of_list(a.sensors) == sensors_of_list(b.sensors) &&
         std::equal(a.sensor_lines.begin(), a.sensor_lines.end(), b.sensor_lines.begin(), b.sensor_lines.end(),
                    same_line) &&
         std::equal(a.axes.begin(), a.axes.end(), b.axes.begin(), b.axes.end(), same_source) &&
         std::equal(a.frames->axes.begin(), a.frames->axes.end(), b.frames->axes.begin(), b.frames->axes.end(),
                    same_axis);
}

// Settings with which each line is opened.
bool same_wires(const Setup& a, const Setup& b) {
  const auto same = [](const auto& one, const auto& other) {
    return one.line == other.line && one.frames->commands == other.frames->commands;
  };
  return same(a, b) &&
         std::equal(a.sensor_lines.begin(), a.sensor_lines.end(), b.sensor_lines.begin(), b.sensor_lines.end(), same);
}

bool same_engines(const Setup& a, const Setup& b) {
  const auto same = [](const auto& one, const auto& other) { return one.engine == other.engine; };
  return std::equal(a.axes.begin(), a.axes.end(), b.axes.begin(), b.axes.end(), same);
}

// Each log keeps its name.
Result<void> same_logs(const Setup& before, const Setup& after) {
  const auto names = [](const Setup& setup) {
    std::vector<std::string> found;
    for (std::size_t i = 0; i < setup.axes.size(); ++i) found.push_back(log_name(setup, i));
    return found;
  };
  if (names(before) == names(after)) return {};
  return make_error(after.config.path, fmt::format("found logs {}, expected {} as before; restart prismd to apply it",
                                                   fmt::join(names(after), ", "), fmt::join(names(before), ", ")));
}

// Each sensor line has its own capture and state.
Result<void> same_sensor_lines(const Setup& before, const Setup& after) {
  const auto names = [](const Setup& setup) {
    std::vector<std::string> found;
    for (const Setup::SensorLine& line : setup.sensor_lines) found.push_back(line.name);
    return found;
  };
  if (names(before) == names(after)) return {};
  return make_error(after.config.path,
                    fmt::format("found sensor lines {}, expected {} as before; restart prismd to apply it",
                                names(after).empty() ? "none" : fmt::to_string(fmt::join(names(after), ", ")),
                                names(before).empty() ? "none" : fmt::to_string(fmt::join(names(before), ", "))));
}

}  // namespace

std::vector<std::unique_ptr<RowWriter>> make_logs(const Setup& setup, const MakeLog& make) {
  std::vector<std::unique_ptr<RowWriter>> logs;
  if (!setup.config.log) return logs;
  config::LogSegmentSettings settings = *setup.config.log;
  if (settings.keep_bytes < config::kNoByteLimit) settings.keep_bytes /= static_cast<std::int64_t>(setup.axes.size());
  for (std::size_t i = 0; i < setup.axes.size(); ++i)
    logs.push_back(make(settings, log_name(setup, i), log_metadata(setup, i)));
  return logs;
}

Acquisition::Acquisition(Setup setup, std::vector<std::unique_ptr<RowWriter>> logs,
                         std::vector<std::unique_ptr<CaptureSink>> captures, Publish publish, Tell tell)
    : setup_(std::move(setup)),
      publish_(std::move(publish)),
      tell_(std::move(tell)),
      captures_(std::move(captures)),
      lines_(1 + setup_.sensor_lines.size()),
      pipeline_(std::make_unique<Pipeline>(setup_)),
      rate_watch_(setup_.frames->rate_hz) {
  logs.resize(setup_.axes.size());
  for (std::size_t i = 0; i < logs.size(); ++i) records_.emplace_back(std::move(logs[i]), axis_prefix(i));
  if (const RowWriter* log = records_.front().log()) log_counters_ = &log->counters();
}

void Acquisition::begin_session(std::size_t line, std::int64_t now_ns) {
  if (!captures_.empty()) captures_[line]->mark_opened(now_ns);
  if (line != kGyroLine) return pipeline_->begin_sensor_session(line - 1, now_ns);
  ++sessions_;
  rate_watch_.begin();
  stages_.begin();
  end_session(pipeline_->begin_session(now_ns));
}

void Acquisition::sent(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t time_ns) {
  if (!captures_.empty()) captures_[line]->sent(bytes, time_ns);
}

void Acquisition::feed(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  lines_[line].last_data_ns = arrival_ns;
  if (!captures_.empty()) captures_[line]->data(bytes, arrival_ns);
  if (line != kGyroLine) return pipeline_->feed_sensors(line - 1, bytes, arrival_ns);
  keep(pipeline_->feed(bytes, arrival_ns));
  watch_stages(arrival_ns);
}

// With sensor lines, writes two marks to every capture, so that a replay finds the same points in all of them, even if
// a line had no data in between.
void Acquisition::clock_set(std::int64_t before_ns, std::int64_t now_ns) {
  for (std::size_t line = kGyroLine + 1; line < lines_.size(); ++line) {
    begin_session(line, before_ns);
    begin_session(line, now_ns);
  }
  if (!captures_.empty() && lines_.size() > 1) captures_[kGyroLine]->mark_opened(before_ns);
  begin_session(kGyroLine, now_ns);
}

// Not for sensor lines: a value is complete when its bytes arrive, never by a time-out, as in a replay.
void Acquisition::expire(std::size_t line, std::int64_t now_ns) {
  if (line == kGyroLine) keep(pipeline_->expire(now_ns));
}

void Acquisition::finish(std::size_t line) {
  if (line != kGyroLine) return;
  if (!captures_.empty()) captures_[line]->flush();
  end_session(pipeline_->finish());
}

void Acquisition::close() {
  for (const AxisRecord& record : records_) {
    if (record.log()) record.log()->close();
  }
  captures_.clear();
}

void Acquisition::sync() {
  for (const AxisRecord& record : records_) {
    if (record.log()) record.log()->sync();
  }
  for (const auto& capture : captures_) capture->flush();
}

Result<bool> Acquisition::reconfigure(Setup setup) {
  for (const auto same : {same_places, same_logs, same_sensor_lines}) {
    if (auto kept = same(setup_, setup); !kept) return tl::unexpected<Error>(kept.error());
  }
  const bool stream = same_stream(setup, setup_);
  const bool reopen = !stream || !same_wires(setup, setup_);
  if (stream && same_engines(setup, setup_)) {
    if (auto used = pipeline_->use_models(setup); !used) return tl::unexpected<Error>(used.error());
  } else {
    end_session(pipeline_->finish());
    frames_before_ = frames();
    pipeline_ = std::make_unique<Pipeline>(setup);
    reported_by_arrival_ = reported_resets_ = 0;
    stages_ = {};
    clocks_alarm_.clear();
  }
  setup_ = std::move(setup);
  rate_watch_ = RateMonitor(setup_.frames->rate_hz);
  for (std::size_t i = 0; i < records_.size(); ++i) {
    records_[i].begin_stability();
    for (const std::string& change : records_[i].end_changes())
      tell_(Severity::kInfo, "question", "ended by the reload: " + change);
    if (records_[i].log()) records_[i].log()->set_metadata(log_metadata(setup_, i));
  }
  return reopen;
}

void Acquisition::keep(const Rows& rows) {
  for (const Rows::Window& window : rows.windows)
    records_[window.axis].keep(window.row, window.session_ns, block_s(window.axis));
  std::uint32_t wanted = (1U << records_.size()) - 1;  // the latest of each axis
  for (std::size_t i = rows.samples.size(); i-- > 0 && wanted != 0;) {
    const std::size_t axis = rows.samples[i].axis;
    if (wanted >> axis & 1) records_[axis].keep(rows.samples[i].row);
    wanted &= ~(1U << axis);
  }
  publish_(rows);
  watch(rows);
}

// Rows from the line's last bytes are stored, but are not current values.
void Acquisition::end_session(const Rows& rows) {
  keep(rows);
  for (AxisRecord& record : records_) record.end_session();
}

void Acquisition::watch(const Rows& rows) {
  for (const Rows::Window& window : rows.windows) {
    records_[window.axis].watch(window.row, tell_);
    if (window.axis != 0 || setup_.frames->counts_frames()) continue;
    if (const auto wrong = rate_watch_.push(window.row.window.second_mean.samples))
      tell_(Severity::kWarning, "rate", setup_.frames->name + ": " + *wrong);
  }
  if (!rows.windows.empty()) watch_clock();
}

void Acquisition::watch_stages(std::int64_t now_ns) {
  if (std::abs(now_ns - stages_checked_ns_) < compensation::kNanosecondsPerSecond) return;
  stages_checked_ns_ = now_ns;
  const auto notice = stages_.push(*pipeline_, now_ns);
  if (notice) tell_(notice->severity(), "no_rate", notice->text);
  if (!clocks_alarm_.set_state(clocks_problem())) return;
  if (!clocks_alarm_.is_active()) return tell_(Severity::kInfo, "rate", "frames arrive as described again");
  last_clocks_problem_ = clocks_alarm_.problem();
  tell_(Severity::kWarning, "rate", last_clocks_problem_);
}

std::string Acquisition::clocks_problem() const { return clocks_text(*setup_.frames, pipeline_->clock().rate_check()); }

void Acquisition::watch_clock() {
  const drivers::ClockStatus& clock = pipeline_->clock().status();
  if (const std::uint64_t lost = clock.missing_by_arrival; lost != reported_by_arrival_) {
    tell_(Severity::kWarning, "frames_lost",
          fmt::format("{} frames lost, counted by arrival times: prismd did not run, or no data came, for longer than "
                      "the gyro's counter can count",
                      lost - reported_by_arrival_));
    reported_by_arrival_ = lost;
  }
  if (clock.resets == reported_resets_) return;
  reported_resets_ = clock.resets;
  tell_(
      Severity::kWarning, "time_restarted",
      setup_.config.device_clock
          ? "the gyro's counter and the arrival times disagree (gyro restarted, or data missing for longer than it can "
            "count): a session begins at the arrival time"
          : "the gyro's counter or a clock jumped: time is measured from arrivals again");
}

}  // namespace prism::pipeline
