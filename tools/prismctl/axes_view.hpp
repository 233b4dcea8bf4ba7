// SPDX-License-Identifier: MIT
// Answers for several axes as text: side by side, or one behind the other.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace prism::prismctl {

/// Names of the axes that an answer holds by name; none where it is of one.
std::vector<std::string> axes_of(const nlohmann::json& answer);

/// A table of a column for each axis, within 80 columns: quality, rate, bias, corrected, temperature, slope, UHFO,
/// model. `axes`: answers by name; `window`: where in each the means of its window stand, "" where in itself.
std::string axes_table(const nlohmann::json& axes, const char* window);

/// Each axis's own view behind its name, or the view of an answer that is of one.
std::string each_axis(const nlohmann::json& answer, const std::function<std::string(const nlohmann::json&)>& view);

}  // namespace prism::prismctl
