// SPDX-License-Identifier: MIT
// What each question is answered, from what is: functions over a constant sources. Finite numbers and texts only.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/socket/sources.hpp"

namespace prism::socket {

nlohmann::ordered_json status_answer(const Sources& sources);
nlohmann::ordered_json config_answer(const Sources& sources);

/// Of one axis, below Acquisition::axes().
nlohmann::ordered_json bias_answer(const Sources& sources, std::size_t axis);
nlohmann::ordered_json stability_answer(const Sources& sources, std::size_t axis);
nlohmann::ordered_json model_answer(const Sources& sources, std::size_t axis);

/// One line for systemd's STATUS= and for people.
std::string summary(const Sources& sources);

}  // namespace prism::socket
