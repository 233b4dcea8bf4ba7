// SPDX-License-Identifier: MIT
// The model file: JSON text ⇄ model. docs/formats.md has the grammar and a worked example.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_table.hpp"
#include "base/result.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/model.hpp"

namespace prism::compensation {

// The common parts of the files of all kernel models: normalisation, centres and matrices.

inline constexpr Range kPositive{1e-300, 1e300};
JsonTable<Normalisation> normalisation_keys();
/// A symmetric matrix from its lower triangle, row by row. Fails at `key` of the section if the count is not n (n + 1)
/// / 2.
Eigen::MatrixXd symmetric_of(const Section& section, const std::string& key, const std::vector<double>& lower);
/// Its numbers in the file; null of an empty one.
Json lower_triangle(const Eigen::MatrixXd& m);
/// Its key.
template <class T>
JsonTable<T>& add_symmetric(JsonTable<T>& keys, const char* key, Eigen::MatrixXd T::*member) {
  return keys.value(
      key, {{"type", "array"}, {"items", limits_schema("number", kAnyNumber)}}, member,
      "the lower triangle, row by row",
      [](const Section& section, const std::string& name) {
        return symmetric_of(section, name, section.numbers(name, kAnyNumber));
      },
      [](const Eigen::MatrixXd& m) { return lower_triangle(m); });
}
/// Gives the numbers of "centres", read as one column, their shape [inputs x alphas]. Fails at "centres" if the count
/// differs.
void shape_centres(const Section& section, Eigen::MatrixXd& centres, std::size_t inputs, Eigen::Index alphas);

// Reads and writes the part of the model file that belongs to each model type. One row per type.

struct ModelKind {
  const char* name;
  /// The schema of the type's own keys.
  Json (*keys)();
  /// Reads them; `info` is complete except for its id, which the reader computes.
  Result<ModelPtr> (*read)(Section& top, ModelInfo info);
  /// The type's own part of the file.
  Json (*print)(const Model& model);
};

/// A complete model, which may be nested in another one; the document's finish() reports keys that are not read here.
Result<ModelPtr> read_model(Section& top);

Json polynomial_keys();
Result<ModelPtr> read_polynomial(Section& top, ModelInfo info);
Json print_polynomial(const Model& model);
Json lssvm_keys();
Result<ModelPtr> read_lssvm(Section& top, ModelInfo info);
Json print_lssvm(const Model& model);
Json composite_keys();
Result<ModelPtr> read_composite(Section& top, ModelInfo info);
Json print_composite(const Model& model);

/// Reads a model of format "prism-model" version 1. `where` names the text in errors (the file's path). Errors, in one
/// line: invalid JSON; another format; a newer version; a missing or unknown key; a wrong type; a number that is not
/// finite or out of range; an id that does not match the content.
Result<ModelPtr> parse_model(std::string_view text, std::string_view where);

/// JSON Schema of a model file, with the keys of all types.
Json model_schema();

/// The file's text: every number exact (up to 17 digits), with a new id. parse_model(format_model(m)) equals m.
std::string format_model(const Model& model);
/// The same with another provenance (a JSON object as text), noise and monitor, which are not part of the id.
std::string format_model(const Model& model, const std::string& provenance_json,
                         const std::optional<RateNoise>& noise = {},
                         const std::optional<MonitorSettings>& monitor = {});

}  // namespace prism::compensation
