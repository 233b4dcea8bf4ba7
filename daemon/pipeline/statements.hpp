// SPDX-License-Identifier: MIT
// Statements on the model of an axis, each in a file of its own: the offset by command, and the verdict of the monitor.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "base/json_table.hpp"
#include "base/result.hpp"
#include "compensation/model.hpp"
#include "daemon/pipeline/setup.hpp"

namespace prism::pipeline {

/// A constant that a person subtracts besides the model's bias, recorded and for a time.
struct Offset {
  double deg_per_h = 0;
  std::string reason;          ///< stated by the person
  std::string model;           ///< id of the model whose error it is
  std::int64_t set_s = 0;      ///< host time
  std::int64_t expires_s = 0;  ///< host time; 0: never

  bool operator==(const Offset&) const = default;
};

JsonTable<Offset> offset_keys();

/// "+0.00200 deg/h until 2026-11-29T20:00:00Z: REASON"
std::string offset_text(const Offset& offset);

/// Makes the offset one of the model. Errors: no model, or one that does not state how switch-ons differ; an offset
/// beyond 3 standard deviations of that: by its monitor, else by its error in another run. A larger shift has another
/// cause: the gyro or its mount has changed.
Result<void> bind_offset(const compensation::ModelPtr& model, Offset& offset);

/// The file that keeps the offset of an axis over a restart, in the directory of its log; empty without a log.
std::string offset_path(const Setup& setup, std::size_t axis);
/// Nullopt if the file does not exist. Errors: it cannot be read, or was changed to something else.
Result<std::optional<Offset>> load_offset(const std::string& path);
/// Without an offset, removes the file.
Result<void> store_offset(const std::string& path, const std::optional<Offset>& offset);
/// Removes the file if it has this offset, which ended: a later one may be stored, but not yet in force.
void forget_offset(const std::string& path, const Offset& ended);

/// The last one of `prismcal monitor`.
struct ModelVerdict {
  std::string verdict;    ///< holds, drifted, too_little or failed
  std::string text;       ///< one sentence
  std::string model;      ///< id
  std::int64_t at_s = 0;  ///< host time
};

using ModelVerdicts = std::map<std::string, ModelVerdict>;  ///< by axis
inline constexpr const char* kOnlyAxis = "-";               ///< of a configuration without axes

/// monitor.json in $STATE_DIRECTORY (set by systemd), else in the directory of the log; empty without a log.
std::string monitor_file(const config::Config& config);
/// Empty if the file is absent or not of prismcal.
ModelVerdicts read_verdicts(const std::string& path);
Result<void> write_verdicts(const std::string& path, const ModelVerdicts& verdicts);

}  // namespace prism::pipeline
