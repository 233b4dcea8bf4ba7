// SPDX-License-Identifier: MIT
// Finding rows of a study and naming them, shared by its tables and figures.
#pragma once

#include "tools/prismcal/analysis/study.hpp"

namespace prism::analysis {

/// "IR-LSSVM, myriad", "stepwise, model 2": the method as people call it.
std::string method_text(const ModelSpec& spec);

/// "ten-fold, shuffled"; a dash where nothing is tuned.
std::string tune_text(const std::string& tune);

/// "1 sigma of 100 s means, divisor N-1": what every caption must say.
std::string basis_text(const Study& study);

/// deg/h → 1e-3 deg/h.
std::optional<double> milli(std::optional<double> value);

std::vector<const StudyRow*> rows_of(const Study& study, const std::string& method, const std::string& tune);

/// The effect on the first evaluated recording: the repeat of the training profile.
const evaluation::BiasStability& on_repeat(const StudyRow& row);

/// The row of a method and tuning with the lowest bias stability on the repeat; null where the study has none.
const StudyRow* best_of(const Study& study, const std::string& method, const std::string& tune);

}  // namespace prism::analysis
