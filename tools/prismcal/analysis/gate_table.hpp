// SPDX-License-Identifier: MIT
// The quality gate of a recording as a table.
#pragma once

#include <nlohmann/json.hpp>

#include "compensation/evaluation/quality_gate.hpp"
#include "tools/prismcal/recordings/block_table.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

Result<evaluation::GateReport> judge_blocks(const recordings::BlockTable& table,
                                            const evaluation::GateSettings& settings = {});
report::Table gate_table(const evaluation::GateReport& gate, const std::string& recording);

/// {"verdict":…,"nothing_to_compensate":…,"findings":[{"name":…,"verdict":…,"value":…,"unit":…,"warn":…,"refuse":…}…]}
nlohmann::ordered_json gate_json(const evaluation::GateReport& gate);

/// One line: "fit for training", or why not.
report::Paragraph gate_paragraph(const evaluation::GateReport& gate, const std::string& recording);

}  // namespace prism::analysis
