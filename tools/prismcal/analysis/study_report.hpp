// SPDX-License-Identifier: MIT
// A study as a report: the paper's tables and figures, what it lacks, and the evidence for the model chosen.
#pragma once

#include "tools/prismcal/analysis/limits.hpp"
#include "tools/prismcal/analysis/study.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

/// The model that one would fly: IR-LSSVM with the usual weight and tuning (study.hpp); without it, the row that is
/// best on the evaluated recordings. Never null for a study with rows.
const StudyRow* chosen_row(const Study& study);

/// All sections but the recordings' own. `kept` is false afterwards where a limit was not kept.
std::vector<report::Section> study_sections(const Study& study, const std::vector<Limit>& limits, bool& kept);

}  // namespace prism::analysis
