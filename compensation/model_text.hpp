// SPDX-License-Identifier: MIT
// The model file: JSON text ⇄ model. docs/formats.md has the grammar and a worked example.
#pragma once

#include <string>
#include <string_view>

#include "base/result.hpp"
#include "compensation/model.hpp"

namespace prism::compensation {

/// Reads a model of format "prism-model" version 1. `where` names the text in errors (the file's path). Errors, in one
/// line: invalid JSON; another format; a newer version; a missing or unknown key; a wrong type; a number that is not
/// finite or out of range; an id that does not match the content.
Result<ModelPtr> parse_model(std::string_view text, std::string_view where);

/// The file's text: every number exact (up to 17 digits), with a new id. parse_model(format_model(m)) equals m.
std::string format_model(const Model& model);
/// The same with another provenance (a JSON object as text), which is not part of the id.
std::string format_model(const Model& model, const std::string& provenance_json);

}  // namespace prism::compensation
