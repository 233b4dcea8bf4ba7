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
  const auto sensors = [](const pipeline::Setup& setup) {
    return setup.sensors ? *setup.sensors : std::vector<SensorName>();
  };
  return a.frames->id == b.frames->id && a.clock.source == b.clock.source && sensors(a) == sensors(b) &&
         std::equal(a.frames->axes.begin(), a.frames->axes.end(), b.frames->axes.begin(), b.frames->axes.end(),
                    same_axis);
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
}

void Acquisition::sync() {
  for (const AxisRecord& record : records_) {
    if (record.log()) record.log()->sync();
  }
  if (capture_) capture_->flush();
}

Result<Acquisition::Reconfigured> Acquisition::reconfigure(pipeline::Setup setup) {
  if (auto same = same_places(setup_.config, setup.config); !same) return tl::unexpected<Error>(same.error());
  if (auto same = same_logs(setup_, setup); !same) return tl::unexpected<Error>(same.error());
  const bool stream = same_stream(setup, setup_);
  Reconfigured done{!stream || !(setup.line == setup_.line), {}};
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
