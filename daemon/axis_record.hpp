// SPDX-License-Identifier: MIT
// What is kept of one input axis: its log, the last hour, figures of stability, and what was told of it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "compensation/block_stability.hpp"
#include "daemon/event_log.hpp"
#include "daemon/history.hpp"
#include "daemon/plausibility_watch.hpp"
#include "daemon/row_log.hpp"

namespace prism::daemon {

class AxisRecord {
 public:
  /// `log` may be null. `prefix`: what stands before the text of an event, "x: " where there are several axes.
  AxisRecord(std::unique_ptr<RowWriter> log, EventLog& events, std::string prefix)
      : log_(std::move(log)), events_(events), prefix_(std::move(prefix)) {}

  /// `axis`: its name; `block_s`: of the blocks that the stability is of.
  void keep(const compensation::CompensatedWindow& row, std::int64_t session_ns, const std::string& axis, int block_s);
  void keep(const compensation::Compensated& row);
  /// What came until now is kept, but is no measurement of now.
  void end_session() { sampled_ = windowed_ = false; }
  /// Another model: figures of two do not mix.
  void begin_stability() { stability_.reset(); }

  RowWriter* log() const { return log_.get(); }
  const compensation::BlockStability& stability() const { return stability_; }
  const History& history() const { return history_; }
  /// Of the session that runs: null before its first frame, before its first full second, and after its end.
  const compensation::Compensated* last_sample() const { return sampled_ ? &last_ : nullptr; }
  const compensation::CompensatedWindow* last_window() const { return windowed_ ? &history_.last() : nullptr; }

 private:
  void watch_quality(const compensation::CompensatedWindow& row);
  void watch_plausibility(const compensation::CompensatedWindow& row);

  std::unique_ptr<RowWriter> log_;
  EventLog& events_;
  std::string prefix_;
  PlausibilityWatch plausibility_watch_;
  compensation::BlockStability stability_;
  History history_;
  compensation::Compensated last_;
  bool sampled_ = false, windowed_ = false;
  std::uint32_t last_quality_ = compensation::kNoModel;
};

}  // namespace prism::daemon
