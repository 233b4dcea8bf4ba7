// SPDX-License-Identifier: MIT
#include "daemon/pipeline/device.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <utility>

namespace prism::pipeline {
namespace {

using drivers::CaptureEvent;

// Keys and kinds of problems.
constexpr const char *kEarthRate = "earth_rate", *kDrifted = "monitor", *kWrongRate = "rate_hz";

// The direction is unknown if its azimuth is not stated and matters.
compensation::AtRest at_rest_of(const Setup& setup, std::size_t axis) {
  const config::AxisConfig& mounted = setup.config.axes[axis];
  std::optional<compensation::AxisPlacement> placement;
  if (mounted.elevation_deg) placement = {setup.config.latitude_deg, *mounted.elevation_deg, mounted.azimuth_deg};
  if (placement && !mounted.azimuth_stated &&
      compensation::azimuth_range_deg_per_h(*placement) >= compensation::kAzimuthMatters)
    placement.reset();
  return {placement, mounted.direction_mrad / 1000, setup.axes[axis].model};
}

void watch_plausibility(const compensation::CompensatedWindow& row, const AxisRecord& axis, Problems& problems) {
  const compensation::SecondMean& now = row.window.second_mean;
  for (const AxisSensor& sensor : kAxisSensors) {
    if (!(now.implausible.*sensor.in_set) && problems.empty()) continue;
    const std::string name = axis.prefix + sensor.name, key = "implausible " + name;
    if (now.implausible.*sensor.in_set) {
      problems.set(key,
                   {.kind = "implausible",
                    .part = axis.name,
                    .text = fmt::format("{} is implausible: {}", name,
                                        compensation::rejection_text(row.rejections.*sensor.rejection, sensor.unit)),
                    .unit = "s",
                    .count = 1});
    } else if (const std::uint64_t seconds = problems.find(key).count;
               seconds > 0 && std::isfinite(now.*sensor.value)) {
      problems.clear(key,
                     fmt::format("{} is plausible again: {:.6g} {} after {} implausible seconds", name,
                                 now.*sensor.value, sensor.unit, seconds),
                     AxisRecord::kCalmS);
    }
  }
}

// Names and places that other programs use; a reload keeps them.
std::vector<std::pair<const char*, std::string>> fixed_names(const Setup& setup) {
  const config::Config& config = setup.config;
  std::vector<std::string> logs, lines;
  for (std::size_t i = 0; i < setup.axes.size(); ++i) logs.push_back(log_name(setup, i));
  for (const Setup::SensorLine& line : setup.sensor_lines) lines.push_back(line.name);
  const auto directory = [](const auto& of) { return of ? of->directory : ""; };
  return {{"name", config.name},
          {"socket/path", config.socket.path},
          {"log/directory", directory(config.log)},
          {"capture/directory", directory(config.capture)},
          {"logs", fmt::to_string(fmt::join(logs, ", "))},
          {"sensor lines", fmt::to_string(fmt::join(lines, ", "))}};
}

bool same_stream(const Setup& a, const Setup& b) {
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
         a.frames->axes == b.frames->axes;
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

}  // namespace

void AxisRecord::keep(const compensation::CompensatedWindow& row, std::int64_t session_ns, int block_s) {
  if (log) log->append(row, session_ns);
  stability.add(row, block_s);
  ++seconds;
  windows += row.window.state == compensation::WindowState::kReady;
  corrected += std::isfinite(row.corrected_deg_per_h);
  last_window = row;
}

// Only changes of quality are events. Implausible values have their own events.
void AxisRecord::watch(const compensation::CompensatedWindow& row, const Tell& tell, Problems& problems) {
  const std::uint32_t quality = row.correction.quality & ~compensation::kImplausible;
  if (std::exchange(last_quality, quality) != quality) {
    const bool harmless =
        quality == compensation::kGood || quality == compensation::kWarming || quality == compensation::kNoModel;
    tell(harmless ? Severity::kInfo : Severity::kWarning, "quality",
         prefix + "quality is now " + compensation::quality_text(quality));
  }
  watch_plausibility(row, *this, problems);
  changes.push(row, {name, prefix, problems});
  if (at_rest.push(row) && at_rest.differs()) watch_rest(problems);
}

void AxisRecord::watch_rest(Problems& problems) {
  const compensation::AtRest::Difference found = *at_rest.difference();
  const std::string key = prefix + kEarthRate;
  const std::string text = fmt::format("{}at rest, {:.2g} deg/h from the Earth rate; model and mount explain ±{:.2g}",
                                       prefix, std::abs(found.deg_per_h), found.sd_deg_per_h);
  if (!*at_rest.differs()) return problems.clear(key, text);
  problems.set(key, {.kind = kEarthRate, .part = name, .text = text + ": moved, remounted, or train again"});
}

Device::Device(Setup own, std::vector<std::unique_ptr<RowWriter>> logs,
               std::vector<std::unique_ptr<CaptureSink>> captures, Publish publish, Tell tell, Problems& found)
    : setup(std::move(own)),
      pipeline(std::make_unique<Pipeline>(setup)),
      lines(1 + setup.sensor_lines.size()),
      axes(setup.axes.size()),
      problems(found),
      publish_(std::move(publish)),
      tell_(std::move(tell)) {
  for (std::size_t i = 0; i < captures.size(); ++i) lines[i].capture = std::move(captures[i]);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    axes[i].name = setup.frames->axes[i].name;
    if (axes.size() > 1) axes[i].prefix = axes[i].name + ": ";
    if (!logs.empty()) axes[i].log = std::move(logs[i]);
    axes[i].at_rest = at_rest_of(setup, i);
  }
  if (axes.front().log) log = &axes.front().log->counters();
  make_outputs();
}

void Device::make_outputs() {
  outputs.clear();
  for (std::size_t i = 0; i < setup.outputs.size(); ++i) outputs.emplace_back(setup, i);
}

const wire::DecoderCounters& Device::decoded(std::size_t line) const {
  return (line == kGyroLine ? pipeline->decoder() : pipeline->sensor_feeds()[line - 1].decoder()).counters();
}

void Device::begin_session(std::size_t line, std::int64_t now_ns) {
  if (lines[line].capture) lines[line].capture->record(CaptureEvent::kOpened, {}, now_ns);
  if (line != kGyroLine) return pipeline->begin_sensor_session(line - 1, now_ns);
  ++sessions;
  stages_.begin();
  end_session(pipeline->begin_session(now_ns));
}

void Device::feed(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  lines[line].last_data_ns = arrival_ns;
  if (lines[line].capture) lines[line].capture->record(CaptureEvent::kData, bytes, arrival_ns);
  if (line != kGyroLine) return pipeline->feed_sensors(line - 1, bytes, arrival_ns);
  keep(pipeline->feed(bytes, arrival_ns), bytes);
  watch_stages(arrival_ns);
}

// With sensor lines, writes two marks to every capture, so that a replay finds the same points in all of them, even if
// a line had no data in between.
void Device::clock_set(std::int64_t before_ns, std::int64_t now_ns) {
  for (std::size_t line = kGyroLine + 1; line < lines.size(); ++line) {
    begin_session(line, before_ns);
    begin_session(line, now_ns);
  }
  if (lines[kGyroLine].capture && lines.size() > 1)
    lines[kGyroLine].capture->record(CaptureEvent::kOpened, {}, before_ns);
  begin_session(kGyroLine, now_ns);
}

// Not for sensor lines: a value is complete when its bytes arrive, never by a time-out, as in a replay.
void Device::expire(std::size_t line, std::int64_t now_ns) {
  if (line == kGyroLine) keep(pipeline->expire(now_ns));
}

void Device::finish(std::size_t line) {
  if (line != kGyroLine) return;
  if (lines[line].capture) lines[line].capture->flush();
  end_session(pipeline->finish());
}

void Device::close() {
  for (const AxisRecord& axis : axes) {
    if (axis.log) axis.log->close();
  }
  for (LineStatus& line : lines) line.capture.reset();
}

void Device::sync() {
  for (const AxisRecord& axis : axes) {
    if (axis.log) axis.log->sync();
  }
  for (const LineStatus& line : lines) {
    if (line.capture) line.capture->flush();
  }
}

Result<bool> Device::reconfigure(Setup next) {
  const auto before = fixed_names(setup), after = fixed_names(next);
  const auto text = [](const std::string& names) { return names.empty() ? "none" : names; };
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (after[i].second != before[i].second)
      return make_error(next.config.path, fmt::format("found {} {}, expected {} as before; restart prismd to apply it",
                                                      after[i].first, text(after[i].second), text(before[i].second)));
  }
  const bool stream = same_stream(next, setup);
  const bool reopen = !stream || !same_wires(next, setup);
  if (stream && same_engines(next, setup)) {
    if (auto used = pipeline->use_models(next); !used) return tl::unexpected<Error>(used.error());
  } else {
    end_session(pipeline->finish());
    frames_before_ = frames();
    pipeline = std::make_unique<Pipeline>(next);
    reported_by_arrival_ = reported_resets_ = 0;
    stages_.begin();
    for (const char* key : {kNoRate, kClocksDiffer, kWrongRate}) problems.forget(key);
  }
  const bool same_outputs = stream && next.config.outputs == setup.config.outputs;
  setup = std::move(next);
  if (!same_outputs) make_outputs();
  for (CorrectedFrames& output : outputs) output.correction_changed();
  for (const char* kind : {"question", kEarthRate, kDrifted}) problems.clear_all(kind, "ended by the reload: ");
  for (std::size_t i = 0; i < axes.size(); ++i) {
    axes[i].name = setup.frames->axes[i].name;
    axes[i].stability.reset();
    axes[i].changes.forget();
    axes[i].at_rest = at_rest_of(setup, i);
    axes[i].verdict.reset();
    if (axes[i].log) axes[i].log->set_metadata(log_metadata(setup, i));
    if (axes[i].offset) pipeline->set_offset(i, axes[i].offset->deg_per_h);
    end_offset_of_other_model(i);
  }
  return reopen;
}

void Device::take_verdicts(const ModelVerdicts& verdicts) {
  for (std::size_t i = 0; i < axes.size(); ++i) {
    AxisRecord& axis = axes[i];
    const auto found = verdicts.find(setup.config.by_axes ? axis.name : kOnlyAxis);
    const compensation::ModelPtr& model = setup.axes[i].model;
    const bool current = found != verdicts.end() && model && found->second.model == model->info().id;
    axis.verdict = current ? std::optional(found->second) : std::nullopt;
    const std::string key = axis.prefix + kDrifted;
    if (current && axis.verdict->verdict == "drifted")
      problems.set(key, {.kind = kDrifted, .part = axis.name, .text = axis.prefix + "model: " + axis.verdict->text});
    else
      problems.clear(key, axis.prefix + "model: " + (current ? axis.verdict->text : "no verdict"));
  }
}

void Device::use_offset(std::size_t axis, std::optional<Offset> offset, const std::string& how) {
  AxisRecord& record = axes[axis];
  if (!offset && !record.offset) return;
  const Offset told = offset ? *offset : *record.offset;
  tell_(Severity::kWarning, "offset", fmt::format("{}offset {}: {}", record.prefix, how, offset_text(told)));
  record.offset = std::move(offset);
  record.offset_ends_s.reset();
  pipeline->set_offset(axis, record.offset ? record.offset->deg_per_h : kUnknown);
  for (CorrectedFrames& output : outputs) output.correction_changed();
  record.stability.reset();
  record.at_rest = at_rest_of(setup, axis);
  problems.clear(record.prefix + kEarthRate, record.prefix + "the offset changed: the comparison starts again");
  if (!record.offset) offset_ended_(axis, told);
  end_offset_of_other_model(axis);
}

void Device::end_offset_of_other_model(std::size_t axis) {
  const compensation::ModelPtr& model = setup.axes[axis].model;
  if (axes[axis].offset && (!model || model->info().id != axes[axis].offset->model))
    use_offset(axis, {}, "ended, another model is in use");
}

void Device::end_offsets(std::int64_t now_s, std::int64_t uptime_s) {
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const std::optional<Offset>& offset = axes[i].offset;
    if (!offset || offset->expires_s == 0) continue;
    std::optional<std::int64_t>& ends_s = axes[i].offset_ends_s;
    if (!ends_s) ends_s = uptime_s + offset->expires_s - std::max(now_s, offset->set_s);
    if (offset->expires_s <= now_s || *ends_s <= uptime_s) use_offset(i, {}, "expired");
  }
}

// The frames leave first: a navigation computer waits for them.
void Device::keep(Rows& rows, std::span<const std::uint8_t> bytes) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const std::vector<std::uint8_t>& sent = outputs[i].push(bytes, rows, pipeline->decoder());
    if (send_ && !sent.empty()) send_(i, sent);
  }
  for (const Rows::Window& window : rows.windows)
    axes[window.axis].keep(window.row, window.session_ns, setup.axes[window.axis].features().length_s);
  std::uint32_t wanted = (1U << axes.size()) - 1;  // the latest of each axis
  for (std::size_t i = rows.samples.size(); i-- > 0 && wanted != 0;) {
    const std::size_t axis = rows.samples[i].axis;
    if (wanted >> axis & 1) axes[axis].last_sample = rows.samples[i].row;
    wanted &= ~(1U << axis);
  }
  publish_(rows);
  watch(rows);
}

// Rows from the line's last bytes are stored, but are not current values.
void Device::end_session(Rows& rows) {
  keep(rows);
  for (AxisRecord& axis : axes) axis.last_sample.reset(), axis.last_window.reset(), axis.at_rest.reset();
}

void Device::watch(const Rows& rows) {
  for (const Rows::Window& window : rows.windows) axes[window.axis].watch(window.row, tell_, problems);
  if (!rows.windows.empty()) watch_clock();
}

void Device::set_or_clear(const char* key, Problem found, const std::string& over) {
  if (found.text.empty()) return problems.clear(key, over);
  problems.set(key, std::move(found));
}

void Device::watch_stages(std::int64_t now_ns) {
  if (std::abs(now_ns - stages_checked_ns_) < compensation::kNanosecondsPerSecond) return;
  stages_checked_ns_ = now_ns;
  const auto failed = Problem::Level::kFailed;
  set_or_clear(kNoRate, {.kind = "no_rate", .level = failed, .text = stages_.push(*pipeline, now_ns)},
               "the gyro's data give rates again");
  const wire::FrameDescription& frames = *setup.frames;
  const drivers::FrameRateCheck& check = pipeline->clock().rate_check();
  const std::string clocks = clocks_text(frames, check);
  if (!clocks.empty() && !problems.has(kClocksDiffer)) clocks_differed = clocks;
  set_or_clear(kClocksDiffer, {.kind = "rate", .level = failed, .text = clocks}, "frames arrive as described again");
  set_or_clear(kWrongRate, {.kind = "rate", .text = tagged_rate_text(frames, check)},
               frames.name + ": frames come as described again");
}

void Device::watch_clock() {
  const drivers::ClockStatus& clock = pipeline->clock().status();
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
      setup.config.device_clock
          ? "the gyro's counter and the arrival times disagree (gyro restarted, or data missing for longer than it can "
            "count): a session begins at the arrival time"
          : "the gyro's counter or a clock jumped: time is measured from arrivals again");
}

}  // namespace prism::pipeline
