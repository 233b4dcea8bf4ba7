// SPDX-License-Identifier: MIT
// Lines of numbers whose columns the configuration names: the choice becomes a part of the description.
#pragma once

#include <string>

#include "base/json_document.hpp"
#include "base/result.hpp"
#include "compensation/text_columns.hpp"

namespace prism::wire {

/// Writes the chosen columns into a description's JSON, as if it had them itself. Nothing chosen: nothing changes.
/// Refused where the description is not of one kind of text line, or has a gyro.
Result<void> choose_columns(Json& description, const std::string& where, const TextColumns& choice);

}  // namespace prism::wire
