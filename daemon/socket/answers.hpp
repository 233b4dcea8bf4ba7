// SPDX-License-Identifier: MIT
// Builds the JSON result of each method from the current state. Contains no NaN or infinity.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/socket/sources.hpp"

namespace prism::socket {

nlohmann::ordered_json status_answer(const Sources& sources);
nlohmann::ordered_json config_answer(const Sources& sources);

/// `axis`: less than Acquisition::axes().
nlohmann::ordered_json bias_answer(const Sources& sources, std::size_t axis);
nlohmann::ordered_json stability_answer(const Sources& sources, std::size_t axis);
nlohmann::ordered_json model_answer(const Sources& sources, std::size_t axis);

/// One human-readable line, also for systemd's STATUS=.
std::string summary(const Sources& sources);

}  // namespace prism::socket
