// SPDX-License-Identifier: MIT
// JSON of the serial lines (the gyro's and the sensor lines) and of the sensors.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "daemon/socket/sources.hpp"

namespace prism::socket {

/// Now; in a replay, the time of the last bytes.
std::int64_t time_of(const Sources& sources);

nlohmann::ordered_json counters_json(const wire::DecoderCounters& counters);
nlohmann::ordered_json clock_json(const pipeline::Pipeline& pipeline);

nlohmann::ordered_json line_answer(const Sources& sources);
/// By name; empty without sensor lines.
nlohmann::ordered_json sensor_lines_answer(const Sources& sources);
/// Current value (null if unknown) and unit of each sensor.
nlohmann::ordered_json sensors_answer(const Sources& sources);

}  // namespace prism::socket
