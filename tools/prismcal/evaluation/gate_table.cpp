// SPDX-License-Identifier: MIT
#include "tools/prismcal/evaluation/gate_table.hpp"

namespace prism {

using report::Mark;

namespace {

Mark mark_of(Verdict verdict) {
  return verdict == Verdict::kPass ? Mark::kGood : verdict == Verdict::kWarn ? Mark::kWarn : Mark::kBad;
}

}  // namespace

Result<GateReport> judge_blocks(const BlockTable& table, const GateSettings& settings) {
  return judge_record(table.column(kInputTemperature), table.bias_deg_per_h, table.follows, settings, table.name);
}

report::Table gate_table(const GateReport& gate, const std::string& recording) {
  report::Table table{"gate",
                      "Is " + recording + " worth training on",
                      "The gate asks before a model is made; thresholds as shown.",
                      {},
                      {}};
  table.columns = {{"question", "", false}, {"verdict", "", false}, {"found, and thresholds", "", false}};
  for (const Finding& finding : gate.findings) {
    table.rows.push_back({report::text_cell(finding.name),
                          report::text_cell(verdict_text(finding.verdict), mark_of(finding.verdict)),
                          report::text_cell(finding.text)});
  }
  return table;
}

nlohmann::ordered_json gate_json(const GateReport& gate) {
  nlohmann::ordered_json findings = nlohmann::ordered_json::array();
  for (const Finding& f : gate.findings) {
    findings.push_back({{"name", f.name},
                        {"verdict", verdict_text(f.verdict)},
                        {"value", f.value},
                        {"unit", f.unit},
                        {f.at_least ? "warn_below" : "warn_above", f.threshold.warn},
                        {f.at_least ? "refuse_below" : "refuse_above", f.threshold.refuse}});
  }
  return {{"verdict", verdict_text(gate.verdict)},
          {"nothing_to_compensate", gate.nothing_to_compensate},
          {"findings", findings}};
}

report::Paragraph gate_paragraph(const GateReport& gate, const std::string& recording) {
  if (gate.nothing_to_compensate)
    return {recording + ": nothing to compensate. " + "No movement above the noise can be blamed on temperature.",
            Mark::kBad};
  if (gate.verdict == Verdict::kRefuse) return {recording + " is not fit for training.", Mark::kBad};
  if (gate.verdict == Verdict::kWarn) return {recording + " can be trained on, with reservations.", Mark::kWarn};
  return {recording + " is fit for training.", Mark::kGood};
}

}  // namespace prism
