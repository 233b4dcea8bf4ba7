// SPDX-License-Identifier: MIT
// prismd's answers as a person reads them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace prism::prismctl {

std::string status_view(const nlohmann::json& status);
std::string bias_view(const nlohmann::json& bias);
std::string stability_view(const nlohmann::json& stability);
std::string line_view(const nlohmann::json& line);
std::string model_view(const nlohmann::json& model);
std::string event_line(const nlohmann::json& event);
/// One line for a window notification's params: the 100 s means, as the model sees them.
std::string window_line(const nlohmann::json& window);
/// What window_line's columns are.
std::string window_heading();

}  // namespace prism::prismctl
