// SPDX-License-Identifier: MIT
// Reasons to doubt a recording before the model that is evaluated on it.
#pragma once

#include <string>
#include <vector>

#include "tools/prismcal/analysis/model_evaluation.hpp"

namespace prism::analysis {

/// Readable reasons to judge the recording before the model: disturbed, a drift or mean of the other sign, another
/// mean than in the training, and the `questions` of the recording. Empty: none.
std::vector<std::string> recording_doubts(const recordings::BlockTable& table, const ModelEvaluation& evaluated,
                                          const std::vector<std::string>& questions);

}  // namespace prism::analysis
