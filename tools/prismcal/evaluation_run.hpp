// SPDX-License-Identifier: MIT
// `prismcal evaluate` as a function: evaluates a model on recordings and makes the report.
#pragma once

#include <string>
#include <vector>

#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/recording_report.hpp"

namespace prism::commands {

struct EvaluateChoice {
  std::string model, limits;
  std::vector<std::string> recordings;
  bool in_sample = false;  ///< the recordings may be those of the training
  CommonOptions common;
};

struct Evaluation {
  std::vector<analysis::EvaluatedRecording> cases;  ///< in the order of the recordings
  report::Report report;
  bool within_limits = true;  ///< false if a limit of choice.limits is violated
};

/// Errors: those of `prismcal evaluate`. Writes no file; see write_report().
Result<Evaluation> evaluate_recordings(const EvaluateChoice& choice);

}  // namespace prism::commands
