// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/study_words.hpp"

#include <fmt/format.h>

#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

std::string method_text(const ModelSpec& spec) {
  if (spec.method == "ls") return "LS, cubic";
  if (spec.method == "stepwise") return spec.inputs.size() == 3 ? "stepwise, model 2" : "stepwise, model 1";
  if (spec.method == "lssvm") return "LSSVM";
  return "IR-LSSVM, " + spec.weight;
}

std::string tune_text(const std::string& tune) {
  if (tune == "shuffled") return "ten-fold, shuffled";
  if (tune == "loo") return "leave-one-out";
  if (tune == "blocked") return "contiguous blocks";
  if (tune == "reml") return "likelihood (REML)";
  return report::kNothing;
}

std::optional<double> milli(std::optional<double> value) { return value ? std::optional(1e3 * *value) : std::nullopt; }

std::string basis_text(const Study& study) {
  return fmt::format("1 sigma of {} s means, divisor {}", study.data.training.features.length_s,
                     evaluation::divisor_text(study.divisor));
}

std::vector<const StudyRow*> rows_of(const Study& study, const std::string& method, const std::string& tune) {
  std::vector<const StudyRow*> rows;
  for (const StudyRow& row : study.rows) {
    if (row.spec.method == method && row.spec.tune == tune) rows.push_back(&row);
  }
  return rows;
}

const evaluation::BiasStability& on_repeat(const StudyRow& row) { return row.judged.front().stability; }

const StudyRow* best_of(const Study& study, const std::string& method, const std::string& tune) {
  const StudyRow* best = nullptr;
  for (const StudyRow* row : rows_of(study, method, tune)) {
    if (!best || on_repeat(*row).after.sd < on_repeat(*best).after.sd) best = row;
  }
  return best;
}

}  // namespace prism::analysis
