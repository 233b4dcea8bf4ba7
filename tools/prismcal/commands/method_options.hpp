// SPDX-License-Identifier: MIT
// What fit, cv and train ask alike: the method and how it is tuned.
#pragma once

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compensation/training/trainer.hpp"

namespace prism::commands {

struct MethodOptions {
  std::string method = "ir-lssvm", weight, tune = "blocked", reweight = "converge", scale = "mad", normalise = "zscore";
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

/// Options → settings, polynomial terms apart. Refuses combinations without a meaning.
Result<training::TrainingSettings> settings_of(const MethodOptions& options);

/// What a training came to, for --json and for the model's provenance. Numbers exact; unknown ones null.
nlohmann::ordered_json summary_json(const training::TrainedModel& trained, const training::TrainingSettings& settings,
                                    const std::vector<std::string>& names);
/// The same for people: a few lines.
std::string summary_text(const training::TrainedModel& trained, const training::TrainingSettings& settings,
                         const std::vector<std::string>& names);

/// Draws on stderr where that is a terminal; the best cost so far.
training::TuningProgress progress_bar(bool quiet);
void end_progress();

/// "prismcal: …" on stderr, exit code 1.
int failed(const Error& error);

}  // namespace prism::commands
