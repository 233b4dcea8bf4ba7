// SPDX-License-Identifier: MIT
// One device's data: bytes go through the pipeline, rows are kept in log, history and statistics, and handed on.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "compensation/block_stability.hpp"
#include "daemon/capture_log.hpp"
#include "daemon/event_log.hpp"
#include "daemon/history.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/plausibility_watch.hpp"
#include "daemon/rate_watch.hpp"
#include "daemon/row_log.hpp"

namespace prism::daemon {

/// Not thread-safe: lives on the live path's thread. What a call returns stands until the next one.
class Acquisition {
 public:
  /// `log` and `capture` may be null: nothing is logged, no bytes are kept. `events` outlives this.
  Acquisition(pipeline::Setup setup, std::unique_ptr<RowWriter> log, std::unique_ptr<CaptureLog> capture,
              EventLog& events);

  /// The line was opened (again) at now_ns.
  const pipeline::Rows& begin_session(std::int64_t now_ns);
  const pipeline::Rows& feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);
  /// Nothing has arrived until now_ns.
  const pipeline::Rows& expire(std::int64_t now_ns);
  /// The line was lost, or the run ends.
  const pipeline::Rows& finish();
  /// The last thing: segments end, nothing more is kept.
  void close();
  /// Once a second: what was written goes to the disk.
  void sync();

  struct Reconfigured {
    bool line_changed = false;  ///< the line has to be opened anew
    pipeline::Rows rows;        ///< what the pipeline before still held
  };
  /// Takes over a new set-up, all of it or none: another frame description, another axis or clock begin a new pipeline;
  /// a changed socket or folder is refused, it needs a restart.
  Result<Reconfigured> reconfigure(pipeline::Setup setup);

  const pipeline::Setup& setup() const { return setup_; }
  const pipeline::Pipeline& pipeline() const { return *pipeline_; }
  const compensation::Engine& engine() const { return pipeline_->axes().front().engine; }
  const compensation::BlockStability& stability() const { return stability_; }
  /// Length in s of the window, and of the blocks that the stability is of: the model's, or the paper's.
  int block_s() const { return features().length_s; }
  /// Seconds of history that a correction takes: the window, and the mean at the far end of its slope.
  int full_s() const { return compensation::history_s(features()); }
  const History& history() const { return history_; }
  /// Of the session that runs: null before its first frame, before its first full second, and after its end.
  const compensation::Compensated* last_sample() const { return sampled_ ? &last_ : nullptr; }
  const compensation::CompensatedWindow* last_window() const { return windowed_ ? &history_.last() : nullptr; }
  const LogCounters* log() const { return log_ ? &log_->counters() : nullptr; }
  /// The log waits for the disk with rows that were returned.
  bool unwritten() const { return log_ && log_->counters().pending > 0; }
  const CaptureLog* capture() const { return capture_.get(); }
  std::uint64_t sessions() const { return sessions_; }
  /// Since the start, over every pipeline that there was.
  std::uint64_t frames() const { return frames_before_ + pipeline_->decoder().counters().frames; }

 private:
  compensation::FeatureDefinition features() const;
  const pipeline::Rows& keep(const pipeline::Rows& rows);
  const pipeline::Rows& end_session(const pipeline::Rows& rows);
  void watch_quality(const compensation::CompensatedWindow& row);
  void watch_rate(const compensation::CompensatedWindow& row);
  void watch_plausibility(const compensation::CompensatedWindow& row);
  void watch_losses();

  pipeline::Setup setup_;
  EventLog& events_;
  std::unique_ptr<RowWriter> log_;
  std::unique_ptr<CaptureLog> capture_;
  std::unique_ptr<pipeline::Pipeline> pipeline_;
  RateWatch rate_watch_;
  PlausibilityWatch plausibility_watch_;
  compensation::BlockStability stability_;
  History history_;
  compensation::Compensated last_;
  bool sampled_ = false, windowed_ = false;
  std::uint64_t sessions_ = 0, frames_before_ = 0;
  std::uint64_t told_by_arrival_ = 0;  ///< of the pipeline's ClockStatus::missing_by_arrival
  std::uint32_t last_quality_ = compensation::kNoModel;
};

}  // namespace prism::daemon
