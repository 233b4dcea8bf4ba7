// SPDX-License-Identifier: MIT
// Builds the JSON results of methods from the current state. They contain no NaN or infinity.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "daemon/pipeline/device.hpp"
#include "daemon/pipeline/line_status.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "daemon/socket/event_log.hpp"
#include "daemon/socket/publisher.hpp"

namespace prism::socket {

/// All members must outlive this.
struct Sources {
  const pipeline::Device& device;
  const EventLog& events;
  const Publisher& publisher;
  std::int64_t started_ns;  ///< host time

  const pipeline::LineStatus& gyro_line() const { return device.lines[pipeline::kGyroLine]; }
};

/// Seconds, truncated to microseconds.
inline double seconds(std::int64_t time_ns) {
  const std::int64_t whole_us = time_ns / 1000;
  return static_cast<double>(whole_us) / 1e6;
}

inline const char* state_name(pipeline::LineState state) {
  constexpr const char* kNames[] = {"none", "connecting", "receiving", "silent", "replaying", "ended"};
  return kNames[static_cast<int>(state)];
}

using Answer = nlohmann::ordered_json (*)(const Sources& sources);
/// `axis`: index into Device::axes.
using AxisAnswer = nlohmann::ordered_json (*)(const Sources& sources, std::size_t axis);

/// Returns nullptr if the method is another one: of an axis, or one that Rpc handles itself.
Answer answer_of(std::string_view method);
/// The same for the methods of an axis.
AxisAnswer axis_answer_of(std::string_view method);

/// Bytes arrive, but for longer than a line may be silent (silence_s, at least three periods) no frame with gyro data
/// that can be used: the last values are old.
bool has_no_frames(const Sources& sources);

/// The quality of the correction in use, with that of the last values; kNoData without current data.
std::uint32_t current_quality(const Sources& sources, std::size_t axis);

/// One human-readable line, also for systemd's STATUS=.
std::string summary(const Sources& sources);

/// Now; in a replay, the time of the last bytes.
std::int64_t time_of(const Sources& sources);

/// {"state": "good", "caution" or "failed", "problems": one line each, the failures first}. Good only if data,
/// corrections, model, log, capture and disk are. Failed: something is lost or must not be used.
nlohmann::ordered_json health_json(const Sources& sources);

/// All settings in force, with defaults and overrides.
nlohmann::ordered_json config_answer(const Sources& sources);

}  // namespace prism::socket
