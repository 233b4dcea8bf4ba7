// SPDX-License-Identifier: MIT
// Options that fit, cv and train share: the method and its tuning.
#pragma once

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compensation/training/trainer.hpp"

namespace prism::commands {

struct MethodOptions {
  std::string method, tune;  ///< empty: method_name_of(), blocked
  std::string weight, reweight = "converge", scale = "mad", normalise = "zscore";
  std::optional<double> c, sigma2, beta, delta;
  double epsilon = 0.1, hampel_floor = 1e-7;
  int folds = 10, threads = 2;
  std::uint64_t seed = 1;
  double p_enter = 0.05, p_remove = 0.10;
  std::string start;
  double memory_mb = 1000;
  bool json = false, quiet = false;
};

void add_method_options(CLI::App& command, MethodOptions& options);

/// The method that is asked for; without one the composite kernel, or ir-lssvm where c, sigma2 or a tuning is given, as
/// version 0.1 took it.
std::string method_name_of(const MethodOptions& options);

/// Options → settings, polynomial terms apart. Refuses combinations without a meaning.
Result<training::TrainingSettings> settings_of(const MethodOptions& options);

/// The terms of a polynomial: a cubic of the only input (ls, eq. 21), or `terms`, begun with those that --start names,
/// else with those of `start` that there are (stepwise). Refuses several inputs with ls, and a term that there is not.
Result<void> set_terms(const MethodOptions& options, const std::vector<std::string>& names, training::TermPowers terms,
                       std::vector<std::string> start, training::TrainingSettings& settings);

/// The result of a training, for --json and for the model's provenance. Numbers exact; unknown ones null.
nlohmann::ordered_json summary_json(const training::TrainedModel& trained, const training::TrainingSettings& settings,
                                    const std::vector<std::string>& names);
/// The same without what a model file does not keep: its own id, and the surface of the search.
nlohmann::ordered_json provenance_json(nlohmann::ordered_json summary);
/// The same as a few readable lines.
std::string summary_text(const training::TrainedModel& trained, const training::TrainingSettings& settings,
                         const std::vector<std::string>& names);

/// Draws on stderr where that is a terminal; the best cost so far.
training::TuningProgress progress_bar(bool quiet);
void end_progress();

}  // namespace prism::commands
