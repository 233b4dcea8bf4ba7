// SPDX-License-Identifier: MIT
// `prismcal evaluate` as a function: a model and recordings in, their judgement and report
// out.
#pragma once

#include <string>
#include <vector>

#include "tools/prismcal/commands/common_options.hpp"

namespace prism::commands {

struct EvaluateChoice {
  std::string model, limits, training;
  std::vector<std::string> recordings;
  CommonOptions common;
};

/// One recording through the model.
struct RecordingEvaluation {
  Loaded loaded;
  analysis::ModelEvaluation evaluation;
  std::string overlap;  ///< with what the model was trained on; empty: none known
};

struct Evaluation {
  std::vector<RecordingEvaluation> cases;  ///< in the order of the recordings
  report::Report report;
  bool kept = true;  ///< every limit of choice.limits
};

/// Refuses what `prismcal evaluate` refuses. Writes nothing: write_report() does.
Result<Evaluation> evaluate_recordings(const EvaluateChoice& choice);

}  // namespace prism::commands
