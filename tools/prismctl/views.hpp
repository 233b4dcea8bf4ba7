// SPDX-License-Identifier: MIT
// prismd's responses as text for a person; --json has all numbers.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "base/result.hpp"

namespace prism::prismctl {

/// Returns a result with the members of its only axis at the top, as scripts read it; unchanged with several axes.
nlohmann::json with_only_axis(nlohmann::json result);

/// Removes the other axes from a result, if `axis` is not empty. Errors: the result has axes, but not this one.
Result<void> choose_axis(nlohmann::json& result, const std::string& axis);

/// Prints the view of each axis of a result after its name; only the view if it has one axis.
std::string each_axis(const nlohmann::json& result, const std::function<std::string(const nlohmann::json&)>& view);

/// Of a complete result, with one or several axes.
std::string status_view(const nlohmann::json& status);
std::string bias_view(const nlohmann::json& result);
/// The part of status_view() with the current values of all axes: seven lines of one axis, or two of each and a
/// heading. The first line of an axis has its quality after the label.
std::string values_view(const nlohmann::json& status);
/// "172 frames good, 5 failed their check, …" of a status.
std::string frame_counts(const nlohmann::json& status);
/// Of a result without axes.
std::string line_view(const nlohmann::json& line);
std::string event_line(const nlohmann::json& event);
/// One line for the params of a window notification: the means of the window, as the model uses them.
std::string window_line(const nlohmann::json& window);
/// Heading of the columns of window_line().
std::string window_heading();

/// Origin of the model of an axis, quality of its recordings and the errors to expect, in about ten lines. Null: no
/// model.
std::string model_view(const nlohmann::json& model);
/// Raw and corrected stability of an axis with 68 % intervals, and a conclusion.
std::string stability_view(const nlohmann::json& stability);

}  // namespace prism::prismctl
