// SPDX-License-Identifier: MIT
// Builds the JSON results of methods from the current state. They contain no NaN or infinity.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "daemon/pipeline/line_status.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "daemon/socket/sources.hpp"

namespace prism::socket {

// JSON values shared by all responses: numbers that may be unknown, times, states.

inline nlohmann::ordered_json known(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

/// Null for an empty text.
inline nlohmann::ordered_json text_or_null(const std::string& text) {
  return text.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(text);
}

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

// JSON of the serial lines (the gyro's and the sensor lines) and of the sensors.

/// Now; in a replay, the time of the last bytes.
std::int64_t time_of(const Sources& sources);

nlohmann::ordered_json counters_json(const wire::DecoderCounters& counters);
nlohmann::ordered_json clock_json(const pipeline::Pipeline& pipeline);

nlohmann::ordered_json line_answer(const Sources& sources);
/// By name; empty without sensor lines.
nlohmann::ordered_json sensor_lines_answer(const Sources& sources);
/// Current value (null if unknown) and unit of each sensor.
nlohmann::ordered_json sensors_answer(const Sources& sources);

// The object `retention` of `status`: limits, deletions so far, and the next one.

/// `next` is null if there is no segment to delete; its `in_s` and `time_s` (host time) are null while a consumer holds
/// the segment without a limit.
nlohmann::ordered_json retention_json(const pipeline::RetentionStatus& status);

}  // namespace prism::socket
