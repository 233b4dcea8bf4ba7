// SPDX-License-Identifier: MIT
// Human-readable text of prismd's responses.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace prism::prismctl {

/// Of a complete result, with one or several axes.
std::string status_view(const nlohmann::json& status);
std::string bias_view(const nlohmann::json& result);
/// Of a result without axes.
std::string line_view(const nlohmann::json& line);
std::string event_line(const nlohmann::json& event);
/// One line for the params of a window notification: the means of the window, as the model uses them.
std::string window_line(const nlohmann::json& window);
/// Heading of the columns of window_line().
std::string window_heading();

}  // namespace prism::prismctl
