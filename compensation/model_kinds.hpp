// SPDX-License-Identifier: MIT
// What each kind of model adds to the model file: how its own part is read and written. One row per kind.
#pragma once

#include <string>
#include <string_view>

#include "base/json_section.hpp"
#include "compensation/model.hpp"

namespace prism::compensation {

struct ModelKind {
  const char* name;
  /// Reads the kind's own keys of the file; `info` is complete but for its id, which the reader computes.
  Result<ModelPtr> (*read)(Section& top, ModelInfo info);
  /// The kind's own part of the file: whole lines of JSON, each ending in ",\n", indented by two.
  std::string (*content)(const Model& model);
};

/// nullptr where no kind has this name.
const ModelKind* find_model_kind(std::string_view name);
/// All names, for refusals: "polynomial", "stepwise", …
std::string model_kind_names();

/// A whole model, which may stand within another one; keys that nobody asked for are left to the document's finish().
Result<ModelPtr> read_model(Section& top);

Result<ModelPtr> read_polynomial(Section& top, ModelInfo info);
std::string polynomial_content(const Model& model);
Result<ModelPtr> read_lssvm(Section& top, ModelInfo info);
std::string lssvm_content(const Model& model);
Result<ModelPtr> read_composite(Section& top, ModelInfo info);
std::string composite_content(const Model& model);

}  // namespace prism::compensation
