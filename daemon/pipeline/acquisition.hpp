// SPDX-License-Identifier: MIT
// Data of one device: passes bytes to the pipeline; logs, counts and publishes the rows.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/alarm.hpp"
#include "daemon/pipeline/axis_record.hpp"
#include "daemon/pipeline/line_status.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "daemon/pipeline/notice.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/rate_monitor.hpp"
#include "daemon/pipeline/stage_monitor.hpp"

namespace prism::pipeline {

/// Returns one log per axis, opened by `make(settings, name, metadata)`; empty if no log is configured. The axes share
/// the configured size limit.
using MakeLog =
    std::function<std::unique_ptr<RowWriter>(config::LogSegmentSettings, std::string name, std::string metadata)>;
std::vector<std::unique_ptr<RowWriter>> make_logs(const Setup& setup, const MakeLog& make);

/// Number of the gyro's line. The lines of Setup::sensor_lines follow in order.
inline constexpr std::size_t kGyroLine = 0;

/// Not thread-safe.
///
/// Rows go to the log, then to `publish`; events about them go to `tell` afterwards.
class Acquisition {
 public:
  using Publish = std::function<void(const Rows&)>;

  /// `logs`: one per axis, or empty (no log). `captures`: one per line, or empty.
  Acquisition(Setup setup, std::vector<std::unique_ptr<RowWriter>> logs,
              std::vector<std::unique_ptr<CaptureSink>> captures, Publish publish, Tell tell);

  /// The line was opened (again) at now_ns.
  void begin_session(std::size_t line, std::int64_t now_ns);
  /// Arrival times never decrease over all lines, except when the host clock was set.
  void feed(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);
  /// Bytes were sent to the device: only stored in the capture.
  void sent(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t time_ns);
  /// The host clock was set from before_ns to now_ns. Begins a session on every line.
  void clock_set(std::int64_t before_ns, std::int64_t now_ns);
  /// No data arrived on the line until now_ns.
  void expire(std::size_t line, std::int64_t now_ns);
  /// The line was lost, or the run ends.
  void finish(std::size_t line);
  /// Must be the last call: closes the segments.
  void close();
  /// Syncs the logs. Call once a second.
  void sync();

  /// Applies a new set-up completely, or not at all. Another frame description, axis or clock starts a new pipeline.
  /// Returns true if the lines must be reopened. Errors: a changed socket, directory or number of logs (needs a
  /// restart).
  Result<bool> reconfigure(Setup setup);

  const Setup& setup() const { return setup_; }
  const Pipeline& pipeline() const { return *pipeline_; }
  std::size_t axes() const { return records_.size(); }
  /// As in the frame description.
  const std::string& axis_name(std::size_t axis) const { return setup_.frames->axes[axis].name; }
  /// Prefix of messages about the axis: "x: ", empty for a device with one axis.
  std::string axis_prefix(std::size_t axis) const { return setup_.axes.size() > 1 ? axis_name(axis) + ": " : ""; }
  const compensation::CompensationEngine& engine(std::size_t axis) const { return pipeline_->axes()[axis].engine; }
  const AxisRecord& record(std::size_t axis) const { return records_[axis]; }
  /// Length of the window and of the stability blocks, s: the model's, or the paper's without a model.
  int block_s(std::size_t axis) const { return setup_.axes[axis].features().length_s; }
  /// History that a correction needs, s: the window, and the mean at the start of its slope.
  int full_s(std::size_t axis) const { return compensation::history_s(setup_.axes[axis].features()); }
  /// Of all axes' logs together; null without a log.
  const LogCounters* log() const { return log_counters_; }
  /// True if published rows are not written yet.
  bool unwritten() const { return log_counters_ && log_counters_->pending > 0; }
  /// Null without a capture.
  const CaptureSink* capture(std::size_t line) const { return captures_.empty() ? nullptr : captures_[line].get(); }
  LineStatus& line(std::size_t line) { return lines_[line]; }
  const LineStatus& line(std::size_t line) const { return lines_[line]; }
  std::size_t lines() const { return lines_.size(); }
  /// Why the gyro's data give no rate now; empty: they do, or no data arrive.
  const std::string& starved() const { return stages_.problem(); }
  /// How described and arrival times of the frames disagree now; empty: they agree, or it is not known.
  std::string clocks_problem() const;
  /// The last disagreement since the start; empty: none.
  const std::string& last_clocks_problem() const { return last_clocks_problem_; }
  /// The disk does not answer; empty: it does. Set by the owner of the disk thread.
  const std::string& disk_problem() const { return disk_alarm_.problem(); }
  /// Returns true if it begins or ends.
  bool set_disk_problem(std::string problem) { return disk_alarm_.set_state(std::move(problem)); }
  std::uint64_t sessions() const { return sessions_; }
  /// Of any line, in the current pipeline.
  std::uint64_t frames_of(std::size_t line) const {
    const auto& decoder = line == kGyroLine ? pipeline_->decoder() : pipeline_->sensor_feeds()[line - 1].decoder();
    return decoder.counters().frames;
  }
  /// Since the start, over all pipelines.
  std::uint64_t frames() const { return frames_before_ + pipeline_->decoder().counters().frames; }

 private:
  void keep(const Rows& rows);
  void end_session(const Rows& rows);
  void watch(const Rows& rows);
  void watch_clock();
  void watch_stages(std::int64_t now_ns);

  Setup setup_;
  const Publish publish_;
  const Tell tell_;
  std::vector<std::unique_ptr<CaptureSink>> captures_;
  std::vector<LineStatus> lines_;
  std::unique_ptr<Pipeline> pipeline_;
  std::vector<AxisRecord> records_;  ///< in order of the pipeline's axes
  const LogCounters* log_counters_ = nullptr;
  RateMonitor rate_watch_;
  StageMonitor stages_;
  std::int64_t stages_checked_ns_ = 0;
  Alarm clocks_alarm_, disk_alarm_;
  std::string last_clocks_problem_;
  std::uint64_t sessions_ = 0, frames_before_ = 0;
  std::uint64_t reported_by_arrival_ = 0, reported_resets_ = 0;  ///< of the pipeline's ClockStatus
};

}  // namespace prism::pipeline
