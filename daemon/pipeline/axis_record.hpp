// SPDX-License-Identifier: MIT
// State of one input axis: its log, latest values, stability and reported quality.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "compensation/block_stability.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "daemon/pipeline/notice.hpp"
#include "daemon/pipeline/plausibility_alarm.hpp"
#include "daemon/pipeline/sensor_changes.hpp"

namespace prism::pipeline {

class AxisRecord {
 public:
  /// `log` may be null. `prefix`: of event texts, "x: " if there are several axes.
  AxisRecord(std::unique_ptr<RowWriter> log, std::string prefix) : log_(std::move(log)), prefix_(std::move(prefix)) {}

  /// `block_s`: length of the stability blocks.
  void keep(const compensation::CompensatedWindow& row, std::int64_t session_ns, int block_s);
  void keep(const compensation::Compensated& row);
  /// Reports a change of quality, values that became implausible or plausible again, and changes of sensors.
  void watch(const compensation::CompensatedWindow& row, const Tell& tell);
  /// The stored values are no longer current.
  void end_session() { sampled_ = windowed_ = false; }
  /// Restarts the stability, after a change of model.
  void begin_stability() { stability_.reset(); }

  struct RowCounts {
    std::uint64_t seconds = 0;    ///< rows
    std::uint64_t windows = 0;    ///< of these: with a full window
    std::uint64_t corrected = 0;  ///< of these: with a corrected rate
  };
  /// Since the start.
  const RowCounts& rows() const { return rows_; }
  /// Changes of sensors that may be faults: one line each.
  std::vector<std::string> changes() const { return with_prefix(changes_.open()); }
  /// Ends these; returns their texts.
  std::vector<std::string> end_changes() { return with_prefix(changes_.end_all()); }
  RowWriter* log() const { return log_.get(); }
  const compensation::BlockStability& stability() const { return stability_; }
  /// Of the current session: null before its first frame or full second, and after its end.
  const compensation::Compensated* last_sample() const { return sampled_ ? &last_sample_ : nullptr; }
  const compensation::CompensatedWindow* last_window() const { return windowed_ ? &last_window_ : nullptr; }

 private:
  std::vector<std::string> with_prefix(std::vector<std::string> texts) const;

  std::unique_ptr<RowWriter> log_;
  std::string prefix_;
  PlausibilityAlarm plausibility_watch_;
  SensorChanges changes_;
  compensation::BlockStability stability_;
  compensation::Compensated last_sample_;
  compensation::CompensatedWindow last_window_;
  RowCounts rows_;
  bool sampled_ = false, windowed_ = false;
  std::uint32_t last_quality_ = compensation::kNoModel;
};

}  // namespace prism::pipeline
