// SPDX-License-Identifier: MIT
// Adds the columns chosen in the configuration to the description of text lines.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "base/result.hpp"
#include "compensation/text_columns.hpp"

namespace prism::wire {

/// Writes the chosen columns into a description's JSON, as if they were part of it. Without a choice it has no effect.
/// Errors: the description does not have exactly one message type of text lines, or has a gyro.
Result<void> choose_columns(nlohmann::ordered_json& description, const std::string& where, const TextColumns& choice);

}  // namespace prism::wire
