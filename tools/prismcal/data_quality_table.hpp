// SPDX-License-Identifier: MIT
// Checks the data quality of a recording; the result as text and JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "compensation/evaluation/data_quality.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/model_evaluation.hpp"

namespace prism::analysis {

Result<evaluation::DataQuality> check_blocks(const recordings::BlockTable& table);

/// {"verdict":…,"nothing_to_compensate":…,"findings":[{"name":…,"verdict":…,"value":…,"unit":…,"warn":…,"refuse":…}…]}
nlohmann::ordered_json data_quality_json(const evaluation::DataQuality& quality);

/// "pass", or "warn (length 150 blocks, expected at least 200)".
std::string data_quality_words(const evaluation::DataQuality& quality);

/// Returns why the recording cannot be used for training; empty if it can.
std::string data_quality_error(const evaluation::DataQuality& quality);

/// A whole recording.
struct Usability {
  Result<evaluation::DataQuality> quality;
  std::string reason;  ///< why it cannot be used; first what was left out of it, which may be the reason. Empty: it can
};
/// `to_train`: else only a disturbance counts, not a record that is short or without a drift.
Usability usability_of(const recordings::Loaded& loaded, bool to_train);

/// One line: whether the recording can be used for training, or why not.
report::Paragraph data_quality_paragraph(const evaluation::DataQuality& quality, const std::string& recording);

/// Readable reasons to judge the recording before the model that is evaluated on it: disturbed, a drift or mean of the
/// other sign, another mean than in the training, and the `questions` of the recording. Empty: none.
std::vector<std::string> recording_doubts(const recordings::BlockTable& table, const ModelEvaluation& evaluated,
                                          const std::vector<std::string>& questions);

}  // namespace prism::analysis
