// SPDX-License-Identifier: MIT
// What each kind of model adds to the model file: how its own part is read and written. One row per kind.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_section.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/model.hpp"
#include "compensation/model_id.hpp"

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

// What the kinds with a kernel share.
inline constexpr Range kPositive{1e-300, 1e300};
Eigen::VectorXd vector_of(const std::vector<double>& values);
Normalisation read_normalisation(Section section);
/// The lower triangle, row by row → the whole matrix; fails at `key` of the section where the count is none of one.
Eigen::MatrixXd symmetric_of(Section& section, const char* key, const std::vector<double>& lower);
/// The centres of a kernel model [inputs x alphas], a column after the other; fails at "centres" where the count is
/// another one. Empty where the section has failed.
Eigen::MatrixXd centres_of(Section& section, const std::vector<double>& numbers, std::size_t inputs,
                           Eigen::Index alphas);
std::string normalisation_text(const Normalisation& n);
/// `  "key": [` … `],`, so many numbers a line.
void append_rows(std::string& text, const char* key, const Eigen::MatrixXd& values, Eigen::Index width);
/// The lower triangle, a row a line, without brackets.
std::string triangle_text(const Eigen::MatrixXd& m);

}  // namespace prism::compensation
