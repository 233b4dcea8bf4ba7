// SPDX-License-Identifier: MIT
// One device's data: bytes go through the pipeline, rows are kept in log, history and statistics, and handed on.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/axis_record.hpp"
#include "daemon/capture_log.hpp"
#include "daemon/event_log.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/rate_watch.hpp"
#include "daemon/row_log.hpp"

namespace prism::daemon {

/// A log for each axis, as `make(settings, name, metadata)` opens it; none where none is configured. They share what
/// the configuration lets the log keep.
using MakeLog =
    std::function<std::unique_ptr<RowWriter>(config::SegmentSettings, std::string name, std::string metadata)>;
std::vector<std::unique_ptr<RowWriter>> make_logs(const pipeline::Setup& setup, const MakeLog& make);

/// Not thread-safe: lives on the live path's thread. What a call returns stands until the next one.
class Acquisition {
 public:
  /// `logs`: one for each axis, or none at all: nothing is logged. `capture` may be null: no bytes are kept. `events`
  /// outlives this.
  Acquisition(pipeline::Setup setup, std::vector<std::unique_ptr<RowWriter>> logs, std::unique_ptr<CaptureLog> capture,
              EventLog& events);

  /// The line was opened (again) at now_ns.
  const pipeline::Rows& begin_session(std::int64_t now_ns);
  const pipeline::Rows& feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);
  /// The same for a sensor line (index into Setup::sensor_lines).
  void begin_sensor_session(std::size_t line, std::int64_t now_ns);
  void feed_sensors(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);
  /// The host's clock was set: what was before_ns by it is now_ns. A session begins on every line.
  const pipeline::Rows& clock_set(std::int64_t before_ns, std::int64_t now_ns);
  /// Nothing has arrived until now_ns.
  const pipeline::Rows& expire(std::int64_t now_ns);
  /// The line was lost, or the run ends.
  const pipeline::Rows& finish();
  /// The last thing: segments end, nothing more is kept.
  void close();
  /// Once a second: what was written goes to the disk.
  void sync();

  /// Of each sensor line; before anything arrives.
  void capture_sensors(std::vector<std::unique_ptr<CaptureLog>> captures) { sensor_captures_ = std::move(captures); }

  struct Reconfigured {
    bool line_changed = false;  ///< the line has to be opened anew
    pipeline::Rows rows;        ///< what the pipeline before still held
  };
  /// Takes over a new set-up, all of it or none: another frame description, another axis or clock begin a new pipeline;
  /// a changed socket, folder or number of logs is refused, it needs a restart.
  Result<Reconfigured> reconfigure(pipeline::Setup setup);

  const pipeline::Setup& setup() const { return setup_; }
  const pipeline::Pipeline& pipeline() const { return *pipeline_; }
  std::size_t axes() const { return records_.size(); }
  /// Of the frame description.
  const std::string& axis_name(std::size_t axis) const { return setup_.frames->axes[axis].name; }
  /// What stands before a text of the axis: "x: " where there are several.
  std::string axis_prefix(std::size_t axis) const { return setup_.axes.size() > 1 ? axis_name(axis) + ": " : ""; }
  const compensation::Engine& engine(std::size_t axis) const { return pipeline_->axes()[axis].engine; }
  const AxisRecord& record(std::size_t axis) const { return records_[axis]; }
  /// Length in s of the window, and of the blocks that the stability is of: the model's, or the paper's.
  int block_s(std::size_t axis) const { return setup_.axes[axis].features().length_s; }
  /// Seconds of history that a correction takes: the window, and the mean at the far end of its slope.
  int full_s(std::size_t axis) const { return compensation::history_s(setup_.axes[axis].features()); }
  /// Of all axes' logs together.
  const LogCounters* log() const { return log_counters_; }
  /// The log waits for the disk with rows that were returned.
  bool unwritten() const { return log_counters_ && log_counters_->pending > 0; }
  const CaptureLog* capture() const { return capture_.get(); }
  const CaptureLog* sensor_capture(std::size_t line) const {
    return line < sensor_captures_.size() ? sensor_captures_[line].get() : nullptr;
  }
  std::uint64_t sessions() const { return sessions_; }
  /// Since the start, over every pipeline that there was.
  std::uint64_t frames() const { return frames_before_ + pipeline_->decoder().counters().frames; }

 private:
  const pipeline::Rows& keep(const pipeline::Rows& rows);
  const pipeline::Rows& end_session(const pipeline::Rows& rows);
  void watch_rate(const compensation::CompensatedWindow& row);
  void watch_losses();

  pipeline::Setup setup_;
  EventLog& events_;
  std::unique_ptr<CaptureLog> capture_;
  std::vector<std::unique_ptr<CaptureLog>> sensor_captures_;  ///< empty, or of each sensor line
  std::unique_ptr<pipeline::Pipeline> pipeline_;
  std::vector<AxisRecord> records_;  ///< as the pipeline's axes
  const LogCounters* log_counters_ = nullptr;
  RateWatch rate_watch_;
  std::uint64_t sessions_ = 0, frames_before_ = 0;
  std::uint64_t told_by_arrival_ = 0;  ///< of the pipeline's ClockStatus::missing_by_arrival
};

}  // namespace prism::daemon
