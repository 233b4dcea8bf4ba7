// SPDX-License-Identifier: MIT
// Metrics of one prismd.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/metrics/exposition.hpp"

namespace prism::metrics {

/// Responses of a prismd (docs/protocol.md); null: not requested, or no response.
struct GyroAnswers {
  nlohmann::json status, line, stability;
};

/// Adds the metrics of one prismd; `gyro` is the label of this name. Without a status, only prism_up 0: old values are
/// not repeated. Null values have no sample.
void add_gyro(Exposition& exposition, const std::string& gyro, const GyroAnswers& answers);

/// Adds the time of writing, so that an old file can be detected.
void add_time(Exposition& exposition, double time_s);

}  // namespace prism::metrics
