// SPDX-License-Identifier: MIT
// Reads and writes the part of the model file that belongs to each model type. One row per type.
#pragma once

#include <string>
#include <string_view>

#include "base/json_section.hpp"
#include "compensation/model.hpp"

namespace prism::compensation {

struct ModelKind {
  const char* name;
  /// Reads the type's own keys of the file; `info` is complete except for its id, which the reader computes.
  Result<ModelPtr> (*read)(Section& top, ModelInfo info);
  /// The type's own part of the file: complete lines of JSON, each ending in ",\n", indented by two.
  std::string (*content)(const Model& model);
};

/// Returns nullptr if no model type has this name.
const ModelKind* find_model_kind(std::string_view name);
/// All names, for error messages: "polynomial", "stepwise", …
std::string model_kind_names();

/// A complete model, which may be nested in another one; the document's finish() reports keys that are not read here.
Result<ModelPtr> read_model(Section& top);

Result<ModelPtr> read_polynomial(Section& top, ModelInfo info);
std::string polynomial_content(const Model& model);
Result<ModelPtr> read_lssvm(Section& top, ModelInfo info);
std::string lssvm_content(const Model& model);
Result<ModelPtr> read_composite(Section& top, ModelInfo info);
std::string composite_content(const Model& model);

}  // namespace prism::compensation
