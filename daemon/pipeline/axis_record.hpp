// SPDX-License-Identifier: MIT
// What is kept of one input axis: its log, its last values, figures of stability, and what was told of it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "compensation/block_stability.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "daemon/pipeline/notice.hpp"
#include "daemon/pipeline/plausibility_watch.hpp"

namespace prism::pipeline {

class AxisRecord {
 public:
  /// `log` may be null. `prefix`: what stands before the text of an event, "x: " if there are several axes.
  AxisRecord(std::unique_ptr<RowWriter> log, std::string prefix) : log_(std::move(log)), prefix_(std::move(prefix)) {}

  /// `block_s`: of the blocks that the stability is of.
  void keep(const compensation::CompensatedWindow& row, std::int64_t session_ns, int block_s);
  void keep(const compensation::Compensated& row);
  /// Tells a change of quality, and what became implausible or plausible again.
  void watch(const compensation::CompensatedWindow& row, const Tell& tell);
  /// What came until now is kept, but is no measurement of now.
  void end_session() { sampled_ = windowed_ = false; }
  /// Another model: figures of two do not mix.
  void begin_stability() { stability_.reset(); }

  RowWriter* log() const { return log_.get(); }
  const compensation::BlockStability& stability() const { return stability_; }
  /// Of the session that runs: null before its first frame, before its first full second, and after its end.
  const compensation::Compensated* last_sample() const { return sampled_ ? &last_sample_ : nullptr; }
  const compensation::CompensatedWindow* last_window() const { return windowed_ ? &last_window_ : nullptr; }

 private:
  std::unique_ptr<RowWriter> log_;
  std::string prefix_;
  PlausibilityWatch plausibility_watch_;
  compensation::BlockStability stability_;
  compensation::Compensated last_sample_;
  compensation::CompensatedWindow last_window_;
  bool sampled_ = false, windowed_ = false;
  std::uint32_t last_quality_ = compensation::kNoModel;
};

}  // namespace prism::pipeline
