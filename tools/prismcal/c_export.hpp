// SPDX-License-Identifier: MIT
// A model as C99 files for firmware: tables, a fixed evaluator, and a self-test with values of the library.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/model.hpp"

namespace prism::c_export {

struct COptions {
  bool single = false;                                                      ///< numbers are float instead of double
  compensation::Extrapolation policy = compensation::Extrapolation::kFlag;  ///< or kClamp
  int max_bytes = 0;  ///< of the tables: a larger kernel model loses centres; 0: no limit
  /// One sentence on what a model with fewer centres loses; needed with max_bytes.
  std::function<Result<std::string>(const compensation::ModelPtr& fewer)> loss;
};

struct CExport {
  std::map<std::string, std::string> files;  ///< texts by name
  std::vector<std::string> remarks;          ///< what prismd does and the files do not, one sentence each
  int bytes = 0;                             ///< of the tables
};

/// Errors (`where`: the model's path): a model of a table, one with inputs of sensors, one with a population prior;
/// tables that exceed max_bytes without any centre; those of loss().
Result<CExport> export_c(const compensation::ModelPtr& model, const std::string& where, const COptions& options);

}  // namespace prism::c_export
