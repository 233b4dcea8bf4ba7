// SPDX-License-Identifier: MIT
// What each question is answered, from what is: functions over a constant instance. Finite numbers and texts only.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/instance.hpp"

namespace prism::daemon {

nlohmann::ordered_json status_answer(const Instance& instance);
nlohmann::ordered_json config_answer(const Instance& instance);

/// Of one axis, below Acquisition::axes().
nlohmann::ordered_json bias_answer(const Instance& instance, std::size_t axis);
nlohmann::ordered_json stability_answer(const Instance& instance, std::size_t axis);
nlohmann::ordered_json model_answer(const Instance& instance, std::size_t axis);

/// One line for systemd's STATUS= and for people.
std::string summary(const Instance& instance);

}  // namespace prism::daemon
