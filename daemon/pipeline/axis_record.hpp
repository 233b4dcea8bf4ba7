// SPDX-License-Identifier: MIT
// State of one input axis: its log, latest values, stability and reported quality.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "base/problems.hpp"
#include "compensation/block_stability.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "daemon/pipeline/notice.hpp"
#include "daemon/pipeline/sensor_changes.hpp"

namespace prism::pipeline {

struct AxisRecord {
  /// Consecutive plausible seconds after which a sensor's fault is over.
  static constexpr int kCalmS = 30;

  std::string name;                ///< as in the frame description
  std::string prefix;              ///< of texts about the axis: "x: "; empty for a device with one axis
  std::unique_ptr<RowWriter> log;  ///< null: none is configured
  compensation::BlockStability stability;
  std::uint64_t seconds = 0;    ///< rows since the start
  std::uint64_t windows = 0;    ///< of these: with a full window
  std::uint64_t corrected = 0;  ///< of these: with a corrected rate
  /// Of the current session: none before its first frame or full second, and after its end.
  std::optional<compensation::Compensated> last_sample;
  std::optional<compensation::CompensatedWindow> last_window;
  SensorChanges changes;
  std::uint32_t last_quality = compensation::kNoModel;  ///< as reported

  /// `block_s`: length of the stability blocks.
  void keep(const compensation::CompensatedWindow& row, std::int64_t session_ns, int block_s);
  /// Reports a change of quality, values that became implausible or plausible again, and changes of sensors.
  void watch(const compensation::CompensatedWindow& row, const Tell& tell, Problems& problems);
};

}  // namespace prism::pipeline
