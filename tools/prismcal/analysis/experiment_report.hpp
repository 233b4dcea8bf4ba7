// SPDX-License-Identifier: MIT
// The report of the experiment: the paper's tables and figures, additional ones, and the chosen model on each
// recording.
#pragma once

#include <optional>

#include "tools/prismcal/analysis/experiment.hpp"
#include "tools/prismcal/analysis/limits.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

/// The recommended model: IR-LSSVM with kUsualWeight and kUsualTune; without it, the row with the smallest residuals on
/// the evaluated recordings. Never null if the experiment has rows.
const ExperimentRow* chosen_row(const Experiment& experiment);

/// Returns all sections, with one for each evaluated recording. Sets `within_limits` to false if a limit is violated.
std::vector<report::Section> experiment_sections(const Experiment& experiment, const std::vector<Limit>& limits,
                                                 bool& within_limits);

// Rows and their names.

/// "IR-LSSVM, myriad", "stepwise, model 2".
std::string method_text(const ModelSpec& spec);

/// "ten-fold, shuffled"; a dash if nothing is tuned.
std::string tune_text(const std::string& tune);

/// "1 sigma of 100 s means, divisor N-1", for captions.
std::string basis_text(const Experiment& experiment);

/// deg/h → 1e-3 deg/h.
std::optional<double> milli(std::optional<double> value);

std::vector<const ExperimentRow*> rows_of(const Experiment& experiment, const std::string& method,
                                          const std::string& tune);

/// Result on the first evaluated recording, the repeat run.
const evaluation::BiasStability& on_repeat(const ExperimentRow& row);

/// The row of a method and tuning with the lowest 1 sigma on the repeat run; null without such a row.
const ExperimentRow* best_of(const Experiment& experiment, const std::string& method, const std::string& tune);

// Tables: the paper's five, with its results for comparison, and additional ones.

/// Table 1: correlation of the bias with T, dT/dt and U on the training recording.
report::Table correlation_table(const Experiment& experiment);
/// Table 2: LS, one input. Table 3: both stepwise models.
report::Table least_squares_table(const Experiment& experiment);
report::Table stepwise_table(const Experiment& experiment);
/// The terms that stepwise regression kept, with their coefficients.
report::Table stepwise_terms_table(const Experiment& experiment);
/// Table 4 (one input) and table 5 (composites and the unweighted LSSVM).
report::Table single_input_table(const Experiment& experiment);
report::Table composite_table(const Experiment& experiment);

/// Model comparison from LS to IR-LSSVM: the best LS and one model of each other type, on all recordings.
report::Table ladder_table(const Experiment& experiment);
/// Every model on every recording.
report::Table profiles_table(const Experiment& experiment);
/// The same method tuned by shuffled folds, leave-one-out and contiguous blocks.
report::Table tuning_table(const Experiment& experiment);

// Figures: 6 to 11 of the paper with this data, and the cost surface of the tuning.

/// Figure 6: bias with T, dT/dt and U over time, on two axes.
report::Figure inputs_figure(const recordings::BlockTable& table);
/// Figure 7: LS models, fit to the training recording and compensation of the repeat run.
report::Figure least_squares_figure(const Experiment& experiment);
/// Figure 8: both stepwise models on the repeat run.
report::Figure stepwise_figure(const Experiment& experiment);
/// Figures 9 and 10: the four weights for each set of inputs of `from` to `to` inputs, regression and compensation.
report::Figure weights_by_inputs_figure(const Experiment& experiment, std::size_t from, std::size_t to);
/// Figure 11: LSSVM and the best IR-LSSVM, all inputs; nullopt if the experiment lacks one of them.
std::optional<report::Figure> lssvm_figure(const Experiment& experiment);
/// Cost of the grid search over (c, sigma2), with the chosen point; nullopt if the row has no grid search.
std::optional<report::Figure> surface_figure(const ExperimentRow& row);

}  // namespace prism::analysis
