// SPDX-License-Identifier: MIT
#include "daemon/acquisition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/arrival_clock.hpp"

namespace prism::daemon {
namespace {

// What a reload may not change, as a refusal; a socket or a folder has users that hold it.
Result<void> same_places(const config::Config& before, const config::Config& after) {
  if (after.socket.path != before.socket.path || after.name != before.name) {
    return refuse(after.path, "name or socket/path changed, expected as before: that needs a restart of prismd");
  }
  const auto directory = [](const std::optional<config::SegmentSettings>& s) {
    return s ? s->directory : std::string();
  };
  if (directory(after.log) != directory(before.log) || directory(after.capture) != directory(before.capture)) {
    return refuse(after.path, "log or capture folder changed, expected as before: that needs a restart of prismd");
  }
  return {};
}

bool same_stream(const pipeline::Setup& a, const pipeline::Setup& b) {
  const auto same_axis = [](const wire::AxisRule& one, const wire::AxisRule& other) {
    return one.name == other.name && one.scale == other.scale && one.thermometer == other.thermometer;
  };
  const auto same_line = [](const pipeline::Setup::SensorLine& one, const pipeline::Setup::SensorLine& other) {
    return one.name == other.name && one.frames->id == other.frames->id && one.stale_after_s == other.stale_after_s;
  };
  const auto same_source = [](const auto& one, const auto& other) { return one.thermometer == other.thermometer; };
  return a.frames->id == b.frames->id && a.clock.source == b.clock.source &&
         sensors_of_list(a.sensors) == sensors_of_list(b.sensors) &&
         std::equal(a.sensor_lines.begin(), a.sensor_lines.end(), b.sensor_lines.begin(), b.sensor_lines.end(),
                    same_line) &&
         std::equal(a.axes.begin(), a.axes.end(), b.axes.begin(), b.axes.end(), same_source) &&
         std::equal(a.frames->axes.begin(), a.frames->axes.end(), b.frames->axes.begin(), b.frames->axes.end(),
                    same_axis);
}

// Of every line: as it is opened.
bool same_wires(const pipeline::Setup& a, const pipeline::Setup& b) {
  const auto same = [](const auto& one, const auto& other) { return one.line == other.line; };
  return a.line == b.line &&
         std::equal(a.sensor_lines.begin(), a.sensor_lines.end(), b.sensor_lines.begin(), b.sensor_lines.end(), same);
}

bool same_engines(const pipeline::Setup& a, const pipeline::Setup& b) {
  const auto same = [](const auto& one, const auto& other) { return one.engine == other.engine; };
  return std::equal(a.axes.begin(), a.axes.end(), b.axes.begin(), b.axes.end(), same);
}

// Each log goes on under its name.
Result<void> same_logs(const pipeline::Setup& before, const pipeline::Setup& after) {
  const auto names = [](const pipeline::Setup& setup) {
    std::vector<std::string> found;
    for (std::size_t i = 0; i < setup.axes.size(); ++i) found.push_back(pipeline::log_name(setup, i));
    return found;
  };
  if (names(before) == names(after)) return {};
  return refuse(after.config.path, fmt::format("has logs {}, expected {} as before: that needs a restart of prismd",
                                               fmt::join(names(after), ", "), fmt::join(names(before), ", ")));
}

// Each has a capture and a state of its own.
Result<void> same_sensor_lines(const pipeline::Setup& before, const pipeline::Setup& after) {
  const auto names = [](const pipeline::Setup& setup) {
    std::vector<std::string> found;
    for (const pipeline::Setup::SensorLine& line : setup.sensor_lines) found.push_back(line.name);
    return found;
  };
  if (names(before) == names(after)) return {};
  return refuse(after.config.path,
                fmt::format("has sensor lines {}, expected {} as before: that needs a restart of prismd",
                            names(after).empty() ? "none" : fmt::to_string(fmt::join(names(after), ", ")),
                            names(before).empty() ? "none" : fmt::to_string(fmt::join(names(before), ", "))));
}

}  // namespace

std::vector<std::unique_ptr<RowWriter>> make_logs(const pipeline::Setup& setup, const MakeLog& make) {
  std::vector<std::unique_ptr<RowWriter>> logs;
  if (!setup.config.log) return logs;
  config::SegmentSettings settings = *setup.config.log;
  settings.keep_bytes /= static_cast<std::int64_t>(setup.axes.size());
  for (std::size_t i = 0; i < setup.axes.size(); ++i)
    logs.push_back(make(settings, pipeline::log_name(setup, i), pipeline::log_metadata(setup, i)));
  return logs;
}

Acquisition::Acquisition(pipeline::Setup setup, std::vector<std::unique_ptr<RowWriter>> logs,
                         std::unique_ptr<CaptureLog> capture, EventLog& events)
    : setup_(std::move(setup)),
      events_(events),
      capture_(std::move(capture)),
      pipeline_(std::make_unique<pipeline::Pipeline>(setup_)),
      rate_watch_(setup_.frames->rate_hz) {
  const std::size_t axes = setup_.axes.size();
  logs.resize(axes);
  for (std::size_t i = 0; i < axes; ++i) records_.emplace_back(std::move(logs[i]), events_, axis_prefix(i));
  if (const RowWriter* log = records_.front().log()) log_counters_ = &log->counters();
}

const pipeline::Rows& Acquisition::begin_session(std::int64_t now_ns) {
  if (capture_) capture_->mark_opened(now_ns);
  ++sessions_;
  rate_watch_.begin();
  return end_session(pipeline_->begin_session(now_ns));
}

const pipeline::Rows& Acquisition::feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  if (capture_) capture_->data(bytes, arrival_ns);
  return keep(pipeline_->feed(bytes, arrival_ns));
}

void Acquisition::begin_sensor_session(std::size_t line, std::int64_t now_ns) {
  if (!sensor_captures_.empty()) sensor_captures_[line]->mark_opened(now_ns);
  pipeline_->begin_sensor_session(line, now_ns);
}

void Acquisition::feed_sensors(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  if (!sensor_captures_.empty()) sensor_captures_[line]->data(bytes, arrival_ns);
  pipeline_->feed_sensors(line, bytes, arrival_ns);
}

// Two marks on every line: a replay finds the same places in each capture, also in one that was silent meanwhile.
const pipeline::Rows& Acquisition::clock_set(std::int64_t before_ns, std::int64_t now_ns) {
  for (std::size_t line = 0; line < setup_.sensor_lines.size(); ++line) {
    begin_sensor_session(line, before_ns);
    begin_sensor_session(line, now_ns);
  }
  if (capture_ && !setup_.sensor_lines.empty()) capture_->mark_opened(before_ns);
  return begin_session(now_ns);
}

const pipeline::Rows& Acquisition::expire(std::int64_t now_ns) { return keep(pipeline_->expire(now_ns)); }

const pipeline::Rows& Acquisition::finish() {
  if (capture_) capture_->flush();
  return end_session(pipeline_->finish());
}

void Acquisition::close() {
  for (const AxisRecord& record : records_) {
    if (record.log()) record.log()->close();
  }
  capture_.reset();
  sensor_captures_.clear();
}

void Acquisition::sync() {
  for (const AxisRecord& record : records_) {
    if (record.log()) record.log()->sync();
  }
  if (capture_) capture_->flush();
  for (const auto& capture : sensor_captures_) capture->flush();
}

Result<Acquisition::Reconfigured> Acquisition::reconfigure(pipeline::Setup setup) {
  if (auto same = same_places(setup_.config, setup.config); !same) return tl::unexpected<Error>(same.error());
  if (auto same = same_logs(setup_, setup); !same) return tl::unexpected<Error>(same.error());
  if (auto same = same_sensor_lines(setup_, setup); !same) return tl::unexpected<Error>(same.error());
  const bool stream = same_stream(setup, setup_);
  Reconfigured done{!stream || !same_wires(setup, setup_), {}};
  if (stream && same_engines(setup, setup_)) {
    if (auto used = pipeline_->use_models(setup); !used) return tl::unexpected<Error>(used.error());
  } else {
    done.rows = end_session(pipeline_->finish());
    frames_before_ = frames();
    pipeline_ = std::make_unique<pipeline::Pipeline>(setup);
    told_by_arrival_ = 0;
  }
  setup_ = std::move(setup);
  rate_watch_ = RateWatch(setup_.frames->rate_hz);
  for (std::size_t i = 0; i < records_.size(); ++i) {
    records_[i].begin_stability();
    if (records_[i].log()) records_[i].log()->set_metadata(pipeline::log_metadata(setup_, i));
  }
  return done;
}

const pipeline::Rows& Acquisition::keep(const pipeline::Rows& rows) {
  for (const pipeline::Rows::Window& window : rows.windows) {
    records_[window.axis].keep(window.row, window.session_ns, (*rows.axes)[window.axis], block_s(window.axis));
    if (window.axis == 0) watch_rate(window.row);
    watch_losses();
  }
  std::uint32_t wanted = (1U << records_.size()) - 1;  // the last of each axis
  for (std::size_t i = rows.samples.size(); i-- > 0 && wanted != 0;) {
    const std::size_t axis = rows.samples[i].axis;
    if (wanted >> axis & 1) records_[axis].keep(rows.samples[i].row);
    wanted &= ~(1U << axis);
  }
  return rows;
}

// What comes out of the line's last bytes is kept, but is no measurement of now.
const pipeline::Rows& Acquisition::end_session(const pipeline::Rows& rows) {
  keep(rows);
  for (AxisRecord& record : records_) record.end_session();
  return rows;
}

void Acquisition::watch_rate(const compensation::CompensatedWindow& row) {
  const auto wrong = rate_watch_.push(row.window.bucket.samples);
  if (wrong) events_.add(Severity::kWarning, "rate", setup_.frames->name + ": " + *wrong, host_time_ns());
}

void Acquisition::watch_losses() {
  const std::uint64_t lost = pipeline_->clock().status().missing_by_arrival;
  if (lost == told_by_arrival_) return;
  events_.add(Severity::kWarning, "frames_lost",
              fmt::format("{} frames lost by their arrival times: this process stood still or the line was silent for "
                          "longer than the gyro's counter can tell",
                          lost - told_by_arrival_),
              host_time_ns());
  told_by_arrival_ = lost;
}

}  // namespace prism::daemon
