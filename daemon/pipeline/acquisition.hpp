// SPDX-License-Identifier: MIT
// One device's data: bytes go through the pipeline; rows are logged, counted, and handed on.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/pipeline/axis_record.hpp"
#include "daemon/pipeline/line_status.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "daemon/pipeline/notice.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/rate_watch.hpp"

namespace prism::pipeline {

/// A log for each axis, as `make(settings, name, metadata)` opens it; none if none is configured. They share what the
/// configuration lets the log keep.
using MakeLog =
    std::function<std::unique_ptr<RowWriter>(config::SegmentSettings, std::string name, std::string metadata)>;
std::vector<std::unique_ptr<RowWriter>> make_logs(const Setup& setup, const MakeLog& make);

/// Lines are numbered: this one is the gyro's, those behind it are Setup::sensor_lines in order.
inline constexpr std::size_t kGyroLine = 0;

/// Not thread-safe.
///
/// Rows go to `publish` as soon as they were given to the log; what is remarkable about them goes to `tell` after them.
class Acquisition {
 public:
  using Publish = std::function<void(const Rows&)>;

  /// `logs`: one for each axis, or none at all: nothing is logged. `captures`: one for each line, or none at all.
  Acquisition(Setup setup, std::vector<std::unique_ptr<RowWriter>> logs,
              std::vector<std::unique_ptr<CaptureSink>> captures, Publish publish, Tell tell);

  /// The line was opened (again) at now_ns.
  void begin_session(std::size_t line, std::int64_t now_ns);
  /// Of all lines the arrival times never decrease, except when a host clock was set.
  void feed(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);
  /// The host's clock was set: what was before_ns by it is now_ns. A session begins on every line.
  void clock_set(std::int64_t before_ns, std::int64_t now_ns);
  /// Nothing has arrived on the line until now_ns.
  void expire(std::size_t line, std::int64_t now_ns);
  /// The line was lost, or the run ends.
  void finish(std::size_t line);
  /// The last call: segments end, nothing more is kept.
  void close();
  /// Once a second: what was written goes to the disk.
  void sync();

  /// Takes over a new set-up, all of it or none: another frame description, another axis or clock begin a new pipeline;
  /// a changed socket, folder or number of logs is refused, it needs a restart. True: the lines have to be opened anew.
  Result<bool> reconfigure(Setup setup);

  const Setup& setup() const { return setup_; }
  const Pipeline& pipeline() const { return *pipeline_; }
  std::size_t axes() const { return records_.size(); }
  /// Of the frame description.
  const std::string& axis_name(std::size_t axis) const { return setup_.frames->axes[axis].name; }
  /// What stands before a text of the axis: "x: " if there are several.
  std::string axis_prefix(std::size_t axis) const { return setup_.axes.size() > 1 ? axis_name(axis) + ": " : ""; }
  const compensation::Engine& engine(std::size_t axis) const { return pipeline_->axes()[axis].engine; }
  const AxisRecord& record(std::size_t axis) const { return records_[axis]; }
  /// Length in s of the window, and of the blocks that the stability is of: the model's, or the paper's.
  int block_s(std::size_t axis) const { return setup_.axes[axis].features().length_s; }
  /// Seconds of history that a correction takes: the window, and the mean at the far end of its slope.
  int full_s(std::size_t axis) const { return compensation::history_s(setup_.axes[axis].features()); }
  /// Of all axes' logs together; null: nothing is logged.
  const LogCounters* log() const { return log_counters_; }
  /// The log waits for the disk with rows that were published.
  bool unwritten() const { return log_counters_ && log_counters_->pending > 0; }
  /// Null: no bytes of the line are kept.
  const CaptureSink* capture(std::size_t line) const { return captures_.empty() ? nullptr : captures_[line].get(); }
  LineStatus& line(std::size_t line) { return lines_[line]; }
  const LineStatus& line(std::size_t line) const { return lines_[line]; }
  std::size_t lines() const { return lines_.size(); }
  std::uint64_t sessions() const { return sessions_; }
  /// Since the start, over every pipeline that there was.
  std::uint64_t frames() const { return frames_before_ + pipeline_->decoder().counters().frames; }

 private:
  void keep(const Rows& rows);
  void end_session(const Rows& rows);
  void watch(const Rows& rows);
  void watch_losses();

  Setup setup_;
  const Publish publish_;
  const Tell tell_;
  std::vector<std::unique_ptr<CaptureSink>> captures_;
  std::vector<LineStatus> lines_;
  std::unique_ptr<Pipeline> pipeline_;
  std::vector<AxisRecord> records_;  ///< as the pipeline's axes
  const LogCounters* log_counters_ = nullptr;
  RateWatch rate_watch_;
  std::uint64_t sessions_ = 0, frames_before_ = 0;
  std::uint64_t told_by_arrival_ = 0;  ///< of the pipeline's ClockStatus::missing_by_arrival
};

}  // namespace prism::pipeline
