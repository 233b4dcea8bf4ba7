// SPDX-License-Identifier: MIT
// JSON values shared by all responses: numbers that may be unknown, times, states.
#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/pipeline/line_status.hpp"

namespace prism::socket {

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

}  // namespace prism::socket
