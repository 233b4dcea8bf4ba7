// SPDX-License-Identifier: MIT
// The model in use and what it achieves, for a person. --json has all numbers.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace prism::prismctl {

/// Origin of the model, quality of its recordings and the errors to expect, in about ten lines. Null: no model.
std::string model_view(const nlohmann::json& model);

/// Raw and corrected stability with 68 % intervals, and a conclusion.
std::string stability_view(const nlohmann::json& stability);

}  // namespace prism::prismctl
