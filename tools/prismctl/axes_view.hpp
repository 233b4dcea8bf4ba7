// SPDX-License-Identifier: MIT
// Text output for several axes: side by side, or one after the other.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace prism::prismctl {

/// Returns the names of the axes in a response by axis; empty for a device with one axis.
std::vector<std::string> axes_of(const nlohmann::json& answer);

/// Returns a table with one column per axis, at most 80 characters wide: quality, rate, bias, corrected, temperature,
/// slope, UHFO, model. `axes`: responses by axis; `window`: member with the means of the window, "" if they are in the
/// response itself.
std::string axes_table(const nlohmann::json& axes, const char* window);

/// Prints the view of each axis after its name; only the view for a device with one axis.
std::string each_axis(const nlohmann::json& answer, const std::function<std::string(const nlohmann::json&)>& view);

}  // namespace prism::prismctl
