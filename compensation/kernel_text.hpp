// SPDX-License-Identifier: MIT
// The common parts of the files of all kernel models: normalisation, centres and matrices.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/json_section.hpp"
#include "compensation/lssvm_model.hpp"

namespace prism::compensation {

inline constexpr Range kPositive{1e-300, 1e300};
Eigen::VectorXd vector_of(const std::vector<double>& values);
Normalisation read_normalisation(Section section);
/// A symmetric matrix from its lower triangle, row by row. Fails at `key` of the section if the count is not n (n + 1)
/// / 2.
Eigen::MatrixXd symmetric_of(Section& section, const char* key, const std::vector<double>& lower);
/// The centres of a kernel model [inputs x alphas], column by column. Fails at "centres" if the count differs. Empty if
/// the section has failed.
Eigen::MatrixXd centres_of(Section& section, const std::vector<double>& numbers, std::size_t inputs,
                           Eigen::Index alphas);
std::string normalisation_text(const Normalisation& n);
/// `  "key": [` … `],`, with `width` numbers per line.
void append_rows(std::string& text, const char* key, const Eigen::MatrixXd& values, Eigen::Index width);
/// The lower triangle, one row per line, without brackets.
std::string triangle_text(const Eigen::MatrixXd& m);

}  // namespace prism::compensation
