// SPDX-License-Identifier: MIT
// The data-quality check of a recording as a table.
#pragma once

#include <nlohmann/json.hpp>

#include "compensation/evaluation/data_quality.hpp"
#include "tools/prismcal/recordings/block_table.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

Result<evaluation::DataQuality> check_blocks(const recordings::BlockTable& table,
                                             const evaluation::DataQualitySettings& settings = {});
report::Table data_quality_table(const evaluation::DataQuality& quality, const std::string& recording);

/// {"verdict":…,"nothing_to_compensate":…,"findings":[{"name":…,"verdict":…,"value":…,"unit":…,"warn":…,"refuse":…}…]}
nlohmann::ordered_json data_quality_json(const evaluation::DataQuality& quality);

/// Why the recording must not be used for training; empty if it may be used.
std::string data_quality_refusal(const evaluation::DataQuality& quality);

/// One line: "fit for training", or why not.
report::Paragraph data_quality_paragraph(const evaluation::DataQuality& quality, const std::string& recording);

}  // namespace prism::analysis
