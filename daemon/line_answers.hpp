// SPDX-License-Identifier: MIT
// What is answered of the serial lines, the gyro's and those beside it, and of the sensors.
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/instance.hpp"

namespace prism::daemon {

nlohmann::ordered_json counters_json(const wire::DecoderCounters& counters);
nlohmann::ordered_json clock_json(const drivers::ClockStatus& clock);

nlohmann::ordered_json line_answer(const Instance& instance);
/// By their names; empty where there are none.
nlohmann::ordered_json sensor_lines_answer(const Instance& instance);
/// Of every sensor its value now, null where it is not known, and its unit.
nlohmann::ordered_json sensors_answer(const Instance& instance);

}  // namespace prism::daemon
