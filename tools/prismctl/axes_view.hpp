// SPDX-License-Identifier: MIT
// Text output for several axes: side by side, or one after the other.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace prism::prismctl {

/// Returns a result with the members of its only axis at the top, as scripts read it; unchanged with several axes.
nlohmann::json with_only_axis(nlohmann::json result);

/// Returns a table with one column per axis, at most 80 characters wide: quality, rate, bias, corrected, temperature,
/// slope, UHFO, model. `axes`: responses by axis; `window`: member with the means of the window, "" if they are in the
/// response itself.
std::string axes_table(const nlohmann::json& axes, const char* window);

/// Prints the view of each axis of a result after its name; only the view if it has one axis.
std::string each_axis(const nlohmann::json& result, const std::function<std::string(const nlohmann::json&)>& view);

}  // namespace prism::prismctl
