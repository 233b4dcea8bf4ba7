// SPDX-License-Identifier: MIT
// The paper's five tables from our data, with the paper's own numbers beside them, and the two that the paper lacks.
#pragma once

#include "tools/prismcal/analysis/study.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

/// Table 1: correlation of the bias with T, dT/dt and U on the training recording.
report::Table correlation_table(const Study& study);
/// Table 2: LS, one input. Table 3: both stepwise models.
report::Table least_squares_table(const Study& study);
report::Table stepwise_table(const Study& study);
/// The terms that stepwise regression kept, with their coefficients.
report::Table stepwise_terms_table(const Study& study);
/// Table 4 (one input) and table 5 (composites and the unweighted LSSVM).
report::Table single_input_table(const Study& study);
report::Table composite_table(const Study& study);

/// The ladder from LS to IR-LSSVM: the best of each kind on the repeat, and the same model on every other recording.
report::Table ladder_table(const Study& study);
/// Every model on every recording.
report::Table profiles_table(const Study& study);
/// The same method tuned by shuffled folds, leave-one-out and contiguous blocks.
report::Table tuning_table(const Study& study);

}  // namespace prism::analysis
