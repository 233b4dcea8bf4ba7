// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/gate_table.hpp"

namespace prism::analysis {

using report::Mark;

namespace {

report::Mark mark_of(evaluation::Verdict verdict) {
  return verdict == evaluation::Verdict::kPass   ? report::Mark::kGood
         : verdict == evaluation::Verdict::kWarn ? report::Mark::kWarn
                                                 : report::Mark::kBad;
}

}  // namespace

Result<evaluation::GateReport> judge_blocks(const recordings::BlockTable& table,
                                            const evaluation::GateSettings& settings) {
  return evaluation::judge_record(table.column(compensation::kInputTemperature), table.bias_deg_per_h, table.follows,
                                  settings, table.name);
}

report::Table gate_table(const evaluation::GateReport& gate, const std::string& recording) {
  report::Table table{"gate",
                      "Is " + recording + " worth training on",
                      "The gate asks before a model is made; thresholds as shown.",
                      {},
                      {}};
  table.columns = {{"question", "", false}, {"verdict", "", false}, {"found, and thresholds", "", false}};
  for (const evaluation::Finding& finding : gate.findings) {
    table.rows.push_back({report::text_cell(finding.name),
                          report::text_cell(evaluation::verdict_text(finding.verdict), mark_of(finding.verdict)),
                          report::text_cell(finding.text)});
  }
  return table;
}

nlohmann::ordered_json gate_json(const evaluation::GateReport& gate) {
  nlohmann::ordered_json findings = nlohmann::ordered_json::array();
  for (const evaluation::Finding& f : gate.findings) {
    findings.push_back({{"name", f.name},
                        {"verdict", evaluation::verdict_text(f.verdict)},
                        {"value", f.value},
                        {"unit", f.unit},
                        {f.at_least ? "warn_below" : "warn_above", f.threshold.warn},
                        {f.at_least ? "refuse_below" : "refuse_above", f.threshold.refuse}});
  }
  return {{"verdict", evaluation::verdict_text(gate.verdict)},
          {"nothing_to_compensate", gate.nothing_to_compensate},
          {"findings", findings}};
}

report::Paragraph gate_paragraph(const evaluation::GateReport& gate, const std::string& recording) {
  if (gate.nothing_to_compensate)
    return {recording + ": nothing to compensate. " + "No movement above the noise can be blamed on temperature.",
            report::Mark::kBad};
  if (gate.verdict == evaluation::Verdict::kRefuse)
    return {recording + " is not fit for training.", report::Mark::kBad};
  if (gate.verdict == evaluation::Verdict::kWarn)
    return {recording + " can be trained on, with reservations.", report::Mark::kWarn};
  return {recording + " is fit for training.", report::Mark::kGood};
}

}  // namespace prism::analysis
