// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/study_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tools/prismcal/analysis/evidence.hpp"
#include "tools/prismcal/analysis/study_figures.hpp"
#include "tools/prismcal/analysis/study_tables.hpp"
#include "tools/prismcal/analysis/study_words.hpp"

namespace prism::analysis {
namespace {

using report::Mark;
using report::Paragraph;
using report::Section;

/// Sigma after over sigma before, summed over the evaluated recordings: low is good everywhere.
double relative_sum(const StudyRow& row) {
  double sum = 0;
  for (const Judgement& judged : row.judged) sum += judged.stability.after.sd / judged.stability.before.sd;
  return sum;
}

bool is_usual(const ModelSpec& spec) { return spec.weight == kUsualWeight && spec.tune == kUsualTune; }

std::vector<std::string> worse_than_nothing(const Study& study, std::size_t recording) {
  std::vector<std::string> worse;
  for (const StudyRow& row : study.rows) {
    if (row.judged[recording].stability.improvement.value_or(0) >= 0) continue;
    const std::string tuned = row.spec.tune.empty() ? "" : fmt::format(" ({})", tune_text(row.spec.tune));
    worse.push_back(fmt::format("{} on {}{}", method_text(row.spec), row.spec.inputs_text(), tuned));
  }
  return worse;
}

report::Section summary(const Study& study) {
  report::Section section{"summary", "Summary", {}};
  const StudyRow& chosen = *chosen_row(study);
  const evaluation::BiasStability& repeat = on_repeat(chosen);
  std::string text = fmt::format(
      "{} on {}, tuned by {}, takes {:.1f} % off the bias stability of the repeated profile: {:.5f} → {:.5f} deg/h.",
      method_text(chosen.spec), chosen.spec.inputs_text(), tune_text(chosen.spec.tune),
      100 * repeat.improvement.value_or(0), repeat.before.sd, repeat.after.sd);
  for (std::size_t i = 1; i < chosen.judged.size(); ++i) {
    const evaluation::BiasStability& other = chosen.judged[i].stability;
    text += fmt::format(" On {} it is {:.1f} %: {:.5f} → {:.5f} deg/h.", study.data.evaluated[i].name,
                        100 * other.improvement.value_or(0), other.before.sd, other.after.sd);
  }
  if (is_usual(chosen.spec))
    text +=
        " It was chosen beforehand, for its method, and tuned on the training recording without a look at the others.";
  section.blocks = {report::Paragraph{text, report::Mark::kGood}, ladder_table(study)};
  for (std::size_t i = 0; i < study.data.evaluated.size(); ++i) {
    const std::vector<std::string> worse = worse_than_nothing(study, i);
    if (worse.empty()) continue;
    section.blocks.push_back(
        report::Paragraph{fmt::format("{} of {} models end worse than no compensation on {}: {}.", worse.size(),
                                      study.rows.size(), study.data.evaluated[i].name, fmt::join(worse, "; ")),
                          report::Mark::kWarn});
  }
  return section;
}

report::Section stepwise_section(const Study& study) {
  report::Section section{
      "stepwise", "Stepwise regression", {stepwise_table(study), stepwise_terms_table(study), stepwise_figure(study)}};
  for (const StudyRow* row : rows_of(study, "stepwise", "")) {
    section.blocks.push_back(report::Paragraph{
        fmt::format("{}: {}.", method_text(row->spec), fmt::join(row->trained.trace, "; ")), report::Mark::kMuted});
  }
  return section;
}

report::Section tuning_section(const Study& study) {
  report::Section section{"tuning", "What the tuning decides", {tuning_table(study)}};
  if (const auto figure = surface_figure(*chosen_row(study))) section.blocks.push_back(*figure);
  for (const StudyRow& row : study.rows) {
    for (const std::string& warning : row.trained.warnings) {
      section.blocks.push_back(report::Paragraph{row.spec.key() + ": " + warning, report::Mark::kMuted});
    }
  }
  return section;
}

/// A section of its own, unless the study trained nothing of the kind.
void add_kernel_section(std::vector<report::Section>& sections, report::Section section, report::Table table,
                        report::Figure figure) {
  if (table.rows.empty()) return;
  section.blocks.push_back(std::move(table));
  if (!figure.plot.panels.empty()) section.blocks.push_back(std::move(figure));
  sections.push_back(std::move(section));
}

}  // namespace

const StudyRow* chosen_row(const Study& study) {
  const StudyRow* best = nullptr;
  for (const StudyRow& row : study.rows) {
    if (is_usual(row.spec)) return &row;
    if (!best || relative_sum(row) < relative_sum(*best)) best = &row;
  }
  return best;
}

std::vector<report::Section> study_sections(const Study& study, const std::vector<Limit>& limits, bool& kept) {
  std::vector<report::Section> sections = {
      summary(study),
      {"correlation", "What the bias moves with", {correlation_table(study), inputs_figure(study.data.training)}},
      {"least_squares", "Least squares", {least_squares_table(study), least_squares_figure(study)}},
      stepwise_section(study)};
  add_kernel_section(sections, {"single", "IR-LSSVM with one input", {}}, single_input_table(study),
                     weights_by_inputs_figure(study, 1, 1));
  add_kernel_section(sections, {"composite", "IR-LSSVM with composite inputs", {}}, composite_table(study),
                     weights_by_inputs_figure(study, 2, 3));
  if (const auto figure = lssvm_figure(study)) sections.back().blocks.push_back(*figure);
  sections.push_back({"profiles", "Other profiles", {profiles_table(study)}});
  sections.push_back(tuning_section(study));
  const StudyRow& chosen = *chosen_row(study);
  for (std::size_t i = 0; i < study.data.evaluated.size(); ++i) {
    const Evidence evidence{fmt::format("r{}", i + 1), &study.data.evaluated[i], &chosen.judged[i],
                            &study.data.training,
                            i == 0 && !chosen.trained.weights.empty() ? &chosen.trained.weights : nullptr};
    report::Section section{evidence.id, fmt::format("{} on {}", method_text(chosen.spec), evidence.table->name), {}};
    if (!limits.empty()) {
      const auto verdicts = check_limits(limits, measure_all(evidence));
      kept = kept && std::all_of(verdicts.begin(), verdicts.end(), [](const LimitVerdict& v) { return v.pass; });
      section.blocks.push_back(limits_table(verdicts, evidence.id, evidence.table->name));
    }
    for (auto& block : evidence_blocks(evidence)) section.blocks.push_back(std::move(block));
    sections.push_back(std::move(section));
  }
  return sections;
}

}  // namespace prism::analysis
