// SPDX-License-Identifier: MIT
// What is answered of the serial lines, the gyro's and those beside it, and of the sensors.
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/socket/sources.hpp"

namespace prism::socket {

nlohmann::ordered_json counters_json(const wire::DecoderCounters& counters);
nlohmann::ordered_json clock_json(const drivers::ClockStatus& clock);

nlohmann::ordered_json line_answer(const Sources& sources);
/// By their names; empty where there are none.
nlohmann::ordered_json sensor_lines_answer(const Sources& sources);
/// Of every sensor its value now, null where it is not known, and its unit.
nlohmann::ordered_json sensors_answer(const Sources& sources);

}  // namespace prism::socket
