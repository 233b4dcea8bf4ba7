// SPDX-License-Identifier: MIT
#include "daemon/acquisition.hpp"

#include <fmt/format.h>

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
  return a.frames->id == b.frames->id && a.frames->gyro.axis == b.frames->gyro.axis &&
         a.frames->gyro.scale == b.frames->gyro.scale && a.clock.source == b.clock.source;
}

}  // namespace

Acquisition::Acquisition(pipeline::Setup setup, std::unique_ptr<RowWriter> log, std::unique_ptr<CaptureLog> capture,
                         EventLog& events)
    : setup_(std::move(setup)),
      events_(events),
      log_(std::move(log)),
      capture_(std::move(capture)),
      pipeline_(std::make_unique<pipeline::Pipeline>(setup_)),
      rate_watch_(setup_.frames->rate_hz) {}

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
  if (log_) log_->close();
  capture_.reset();
}

void Acquisition::sync() {
  if (log_) log_->sync();
  if (capture_) capture_->flush();
}

Result<Acquisition::Reconfigured> Acquisition::reconfigure(pipeline::Setup setup) {
  if (auto same = same_places(setup_.config, setup.config); !same) return tl::unexpected<Error>(same.error());
  const bool stream = same_stream(setup, setup_);
  Reconfigured done{!stream || !(setup.line == setup_.line), {}};
  if (stream && setup.config.engine == setup_.config.engine) {
    if (auto used = pipeline_->use_models(setup); !used) return tl::unexpected<Error>(used.error());
  } else {
    done.rows = end_session(pipeline_->finish());
    frames_before_ = frames();
    pipeline_ = std::make_unique<pipeline::Pipeline>(setup);
    told_by_arrival_ = 0;
  }
  setup_ = std::move(setup);
  rate_watch_ = RateWatch(setup_.frames->rate_hz);
  stability_.reset();  // figures of two models do not mix
  if (log_) log_->set_metadata(pipeline::log_metadata(setup_));
  return done;
}

compensation::FeatureDefinition Acquisition::features() const {
  return setup_.model ? setup_.model->info().features : compensation::FeatureDefinition{};
}

const pipeline::Rows& Acquisition::keep(const pipeline::Rows& rows) {
  for (const pipeline::Rows::Window& window : rows.windows) {
    if (log_) log_->append(window.row, window.session_ns);
    stability_.add(window.row, block_s());
    history_.add(window.row);
    watch_quality(window.row);
    watch_rate(window.row);
    watch_plausibility(window.row);
    watch_losses();
  }
  if (!rows.samples.empty()) {
    last_ = rows.samples.back().row;
    sampled_ = true;
  }
  windowed_ = windowed_ || !rows.windows.empty();
  return rows;
}

// What comes out of the line's last bytes is kept, but is no measurement of now.
const pipeline::Rows& Acquisition::end_session(const pipeline::Rows& rows) {
  keep(rows);
  sampled_ = windowed_ = false;
  return rows;
}

// A change of quality is an event; a flood of rows with the same fault is not. What is implausible has events of its
// own.
void Acquisition::watch_quality(const compensation::CompensatedWindow& row) {
  const std::uint32_t quality = row.correction.quality & ~compensation::kImplausible;
  if (quality == last_quality_) return;
  last_quality_ = quality;
  const bool harmless =
      quality == compensation::kGood || quality == compensation::kWarming || quality == compensation::kNoModel;
  events_.add(harmless ? Severity::kInfo : Severity::kWarning, "quality",
              "quality is now " + compensation::quality_text(quality), host_time_ns());
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

void Acquisition::watch_plausibility(const compensation::CompensatedWindow& row) {
  for (const PlausibilityWatch::Notice& notice : plausibility_watch_.push(row))
    events_.add(notice.entered ? Severity::kWarning : Severity::kInfo, "implausible", notice.text, host_time_ns());
}

}  // namespace prism::daemon
